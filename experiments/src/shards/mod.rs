//! An experiment in parts that know nothing of one another, for machines that share no more than a folder.
//!
//! `neumann plan` divides all that an experiment renders ([`crate::runner::works`]) into shards of similar length, each a range of whole groups of
//! replicates ([`plan`]); `neumann run --shard I/N` renders one into a file ([`file`](mod@file), [`growing`]); `neumann merge` looks through the files ([`folder`]) and runs the
//! experiment, whose jobs take their replicates from there ([`stream`]) instead of rendering them. All that follows from replicates is worked out
//! by the same code in the same order, so that a merge has the bits of a run in one piece. `neumann submit` writes what engines need to run all of
//! that ([`engines`]).
//!
//! A shard holds its replicates one by one, and not their moments, where these don't tell what is noted of replicates: a covariance or an error
//! of a replicate follows from the mean of all before it, which other machines render, and the weights of a reference from its pilots. Of images
//! that are judged by nothing later groups are noted as wholes ([`crate::observations::ONE_BY_ONE`]), and kept as moments.

pub mod choice;
pub mod engines;
pub mod file;
pub mod folder;
pub mod growing;
pub mod plan;
pub mod probe;
pub mod stream;

pub use choice::ShardChoice;
pub use folder::Shards;
pub use plan::ShardPlan;

use crate::error::Error;
use crate::machine::{VERSION, machine};
use crate::program::program;
use crate::result::Origin;

/// The folder of the shards' files, in that of the results.
pub const FOLDER: &str = "shards";

/// What this program is, and what it runs on with so many threads.
pub fn origin(threads: usize) -> Origin {
    Origin { neumann: VERSION.to_owned(), program: program().clone(), machine: machine(threads) }
}

/// Whether numbers of another build or architecture are taken for those of the plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foreign {
    /// Never: bits may differ.
    Refused,
    /// The user says so.
    Allowed,
}

impl Foreign {
    /// As a flag says.
    pub fn of_flag(allowed: bool) -> Self {
        if allowed { Self::Allowed } else { Self::Refused }
    }
}

/// Why numbers made here would not have the bits of those made there; `None` if they have.
pub fn difference(there: &Origin, here: &Origin, foreign: Foreign) -> Option<String> {
    if there.neumann != here.neumann {
        return Some(format!("neumann {}, not {}", here.neumann, there.neumann));
    }
    let kind = |origin: &Origin| {
        let Origin { program, machine, .. } = origin;
        format!(
            "{} with {} kernels, built by {} ({})",
            machine.platform, machine.kernels, program.compiler, program.profile
        )
    };
    if foreign == Foreign::Allowed {
        return None;
    }
    if kind(there) != kind(here) {
        return Some(format!("{}, not {}", kind(here), kind(there)));
    }
    (there.program != here.program).then(|| "another build of the same sources".to_owned())
}

/// Refuses to work for a plan that was made by another program or for another architecture.
///
/// # Errors
/// If they differ, with the mend.
pub fn check_origin(plan: &ShardPlan, threads: usize, foreign: Foreign) -> Result<(), Error> {
    let here = origin(threads);
    let Some(difference) = difference(&plan.origin, &here, foreign) else { return Ok(()) };
    let mend = match plan.origin.neumann == here.neumann {
        true => "run the program that made the plan on a machine like that, or accept other bits with --allow-foreign",
        false => "run the program that made the plan, or plan anew with this one in another folder",
    };
    Err(Error::usage(format!("the plan was made by another program: this is {difference}; {mend}")))
}
