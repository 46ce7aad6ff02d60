//! `neumann completions` and `neumann man`: what shells and readers of manuals want to know, from the command line's own description.

use crate::cli::{Cli, CompletionsArgs, ManArgs, print};
use crate::error::{Error, NO_PLACE, Status};
use crate::export::write_atomically;
use clap::CommandFactory;

/// Prints a shell's completions.
///
/// # Errors
/// If they cannot be printed.
pub fn completions(args: &CompletionsArgs) -> Result<Status, Error> {
    let mut bytes = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "neumann", &mut bytes);
    print(&String::from_utf8_lossy(&bytes))?;
    Ok(Status::Done)
}

/// Prints the manual's first page, or writes all pages into a folder.
///
/// # Errors
/// If a page cannot be made or written.
pub fn man(args: &ManArgs) -> Result<Status, Error> {
    let failed = |e: std::io::Error| Error::usage(format!("the manual cannot be made: {e}"));
    let mut program = Cli::command();
    program.build();
    let page = |command: clap::Command| {
        let mut bytes = Vec::new();
        clap_mangen::Man::new(command).render(&mut bytes).map_err(failed)?;
        Ok::<_, Error>(bytes)
    };
    let Some(folder) = &args.out else {
        print(&String::from_utf8_lossy(&page(program)?))?;
        return Ok(Status::Done);
    };
    std::fs::create_dir_all(folder).map_err(|source| Error::Io {
        action: "write",
        path: folder.clone(),
        source,
        mend: NO_PLACE,
    })?;
    for command in program.get_subcommands().filter(|command| command.get_name() != "help") {
        let name = format!("neumann-{}", command.get_name());
        let bytes = page(command.clone())?;
        write_atomically(&folder.join(format!("{name}.1")), &bytes)?;
    }
    write_atomically(&folder.join("neumann.1"), &page(program)?)?;
    Ok(Status::Done)
}
