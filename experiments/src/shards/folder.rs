//! All shards of a plan, looked through; and what is wrong with those that cannot be merged.

use super::file::{self, Contents, Look, Place};
use super::stream::{self, Take, Taken};
use super::{FOLDER, Foreign, ShardPlan, difference};
use crate::error::Error;
use crate::result::Origin;
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};
use std::io::{self, Read};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Where all replicates of a plan lie.
pub struct Shards {
    files: Vec<PathBuf>,
    /// Unit by unit, in the order of replicates: file and place.
    records: Vec<Vec<(usize, Place)>>,
    /// Units by the hash of what their numbers follow from.
    units: HashMap<blake3::Hash, usize>,
    /// Who rendered them, shard by shard.
    pub origins: Vec<Origin>,
}

/// What was found in the folder of shards.
pub enum Found {
    /// All that is needed, and nothing else.
    All(Shards),
    /// What is not as it should be.
    Faults(Faults),
}

/// What is not as it should be.
#[derive(Default)]
pub struct Faults {
    /// All of it, a line each, with what to do about it.
    pub told: Vec<String>,
    /// Those of the lines that no rendering mends: files that have to be removed.
    pub by_hand: Vec<String>,
    /// The shards that have to be rendered.
    pub missing: Vec<u32>,
}

impl Faults {
    /// Adds one that rendering a shard mends.
    fn rendering_mends(&mut self, shard: u32, told: String) {
        self.missing.push(shard);
        self.told.push(told);
    }

    /// Adds one that only the user can mend.
    fn user_mends(&mut self, told: String) {
        self.by_hand.push(told.clone());
        self.told.push(told);
    }
}

impl Shards {
    /// Looks through all shards of a plan in the current thread pool.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn find(folder: &Path, plan: &ShardPlan, foreign: Foreign, look: Look) -> Result<Found, Error> {
        let files = files(folder)?;
        let scanned: Vec<io::Result<Contents>> = files.par_iter().map(|path| file::scan(path, look)).collect();
        let mut survey = Survey { folder, plan, foreign, faults: Faults::default(), good: BTreeMap::new() };
        for (path, contents) in files.into_iter().zip(scanned) {
            survey.judge(path, contents);
        }
        Ok(survey.end())
    }

    /// Has the records of the unit whose numbers follow from what has this hash taken in order, some of them side by side, until `take` breaks.
    ///
    /// # Errors
    /// If a record cannot be read or taken, some of it is left, it does not fit its hash, or there is none.
    pub fn each(&self, content: &blake3::Hash, taken: Taken, take: &mut Take) -> Result<(), Error> {
        let records = self.units.get(content).map(|&unit| self.records[unit].as_slice());
        match records.filter(|records| !records.is_empty()) {
            Some(records) => stream::records(&self.files, records, taken, take),
            None => Err(Error::usage("the plan lacks what this experiment asks for; plan anew in another folder")),
        }
    }

    /// Reads the one record of a unit that is not divided.
    ///
    /// # Errors
    /// Those of [`Self::each`].
    pub fn read<T>(&self, content: &blake3::Hash, read: impl Fn(&mut dyn Read) -> io::Result<T>) -> Result<T, Error> {
        let mut value = None;
        self.each(content, Taken::InTurn, &mut |_, bytes| {
            value = bytes.iter_mut().map(|bytes| read(bytes)).next().transpose()?;
            Ok(ControlFlow::Break(()))
        })?;
        value.ok_or_else(|| Error::usage("the plan lacks what this experiment asks for; plan anew in another folder"))
    }
}

/// The files that may be shards, in order.
fn files(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let folder = folder.join(FOLDER);
    let entries = match std::fs::read_dir(&folder) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(source) => {
            return Err(Error::Io { action: "read", path: folder, source, mend: "let it be read" });
        }
        Ok(entries) => entries,
    };
    let paths = entries.flatten().map(|entry| entry.path());
    let visible = |path: &PathBuf| !path.file_name().unwrap_or_default().to_string_lossy().starts_with('.');
    let mut files: Vec<PathBuf> =
        paths.filter(|path| path.extension().is_some_and(|e| e == "shard") && visible(path)).collect();
    files.sort();
    Ok(files)
}

/// A folder while it is looked through.
struct Survey<'a> {
    folder: &'a Path,
    plan: &'a ShardPlan,
    foreign: Foreign,
    faults: Faults,
    good: BTreeMap<u32, (PathBuf, Contents)>,
}

impl Survey<'_> {
    fn judge(&mut self, path: PathBuf, contents: io::Result<Contents>) {
        let (plan, told) = (self.plan, path.display().to_string());
        let remove = remove(&path);
        let contents = match contents {
            Ok(contents) => contents,
            Err(e) => return self.corrupt(&path, &reason(&e)),
        };
        // The head is among what is hashed: a plan or a number that does not fit may be all that is damaged.
        if let Some(fault) = &contents.fault {
            return self.corrupt(&path, fault);
        }
        let shard = contents.head.shard;
        let ours = contents.head.plan.to_hex().as_str() == plan.hash && (1..=plan.count()).contains(&shard);
        if !ours {
            return self.faults.user_mends(format!("foreign: {told} is of another plan; {remove}"));
        }
        if !contents.places.iter().map(Place::content).eq(plan.contents(shard)) {
            return self.corrupt(&path, "it holds other replicates than the plan says");
        }
        if let Some(difference) = difference(&plan.origin, &contents.head.origin, self.foreign) {
            let accept = format!("accept other bits by neumann merge {} --allow-foreign, or", self.quoted_folder());
            let mend = format!("{accept} remove it and {}", self.again(shard));
            self.faults.missing.push(shard);
            return self.faults.user_mends(format!("foreign: {told} was rendered by {difference}; {mend}"));
        }
        if let Some((first, _)) = self.good.get(&shard) {
            let (first, shard) = (first.display(), contents.head.shard);
            return self.faults.user_mends(format!("duplicate: {told} is shard {shard} like {first}; {remove}"));
        }
        self.good.insert(shard, (path, contents));
    }

    /// Notes a damaged file: rendering makes the shard anew that its name tells; another one has to be removed.
    fn corrupt(&mut self, path: &Path, fault: &str) {
        let told = |mend: String| format!("corrupt: {} ({fault}); {mend}", path.display());
        match (1..=self.plan.count()).find(|&shard| self.plan.file(self.folder, shard) == path) {
            Some(shard) => self.faults.rendering_mends(shard, told(self.again(shard))),
            None => self.faults.user_mends(told(remove(path))),
        }
    }

    /// The command that renders a shard again.
    fn again(&self, shard: u32) -> String {
        format!("run {}", self.plan.command(self.folder, shard))
    }

    fn quoted_folder(&self) -> String {
        super::plan::quoted(&self.folder.to_string_lossy())
    }

    fn end(mut self) -> Found {
        for shard in 1..=self.plan.count() {
            if !self.good.contains_key(&shard) && !self.faults.missing.contains(&shard) {
                self.faults.rendering_mends(shard, format!("missing: shard {shard}; {}", self.again(shard)));
            }
        }
        if !self.faults.told.is_empty() {
            self.faults.missing.sort_unstable();
            self.faults.missing.dedup();
            return Found::Faults(self.faults);
        }
        let units = self.plan.units.iter().enumerate();
        let known = units.filter_map(|(i, unit)| Some((blake3::Hash::from_hex(&unit.content).ok()?, i)));
        let (records, units) = (vec![Vec::new(); self.plan.units.len()], known.collect());
        let mut shards = Shards { files: Vec::new(), records, units, origins: Vec::new() };
        // Shards follow one another as their replicates do.
        for (path, contents) in self.good.into_values() {
            for place in contents.places {
                shards.records[place.unit as usize].push((shards.files.len(), place));
            }
            shards.files.push(path);
            shards.origins.push(contents.head.origin);
        }
        Found::All(shards)
    }
}

/// The command that removes a file.
fn remove(path: &Path) -> String {
    format!("remove it: rm {}", super::plan::quoted(&path.to_string_lossy()))
}

fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => "it ends too early".to_owned(),
        _ => error.to_string(),
    }
}
