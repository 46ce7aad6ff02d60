//! `neumann run --shard`: one shard of a plan, from what an earlier process has left of it to its file.

use crate::budget;
use crate::cli::{ChangeArgs, RunArgs, print};
use crate::error::{Error, Status};
use crate::integrals;
use crate::job::Work;
use crate::plan::Plan;
use crate::progress::{Progress, Verbosity, while_loading};
use crate::runner::works::{self, Task};
use crate::shards::file::{self, Head, Look, Place};
use crate::shards::growing::Growing;
use crate::shards::plan::UnitOfWork;
use crate::shards::{self, Foreign, ShardChoice, ShardPlan};
use crate::source::Source;
use crate::stop::Stop;
use integrators::statistics::GROUP;
use integrators::{Methods, Render};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Renders a shard. One that is complete is left as it is.
///
/// # Errors
/// If there is no such shard, the experiment or the program is not that of the plan, or the file cannot be written.
pub fn run(
    args: &RunArgs,
    choice: ShardChoice,
    methods: &Methods,
    verbosity: Verbosity,
    stop: &Stop,
) -> Result<Status, Error> {
    let source = Source::open(&args.experiment)?;
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from("results").join(&source.name));
    let divided = ShardPlan::read(&folder)?;
    let shard = choice.number(divided.count(), |name| std::env::var(name).ok())?;
    if args.changes != ChangeArgs::default() {
        return Err(Error::usage("a shard is of its plan's experiment; give flags that change it to `neumann plan`"));
    }
    divided.check_source(&source)?;
    let pool = budget::pool(args.threads)?;
    let threads = pool.current_num_threads();
    shards::check_origin(&divided, threads, Foreign::of_flag(args.allow_foreign))?;
    let place = divided.file(&folder, shard);
    if is_complete(&place, &divided, shard) && !args.fresh {
        return said(verbosity, &format!("shard {shard} of {} is complete\n", divided.count()));
    }
    let mut plan = while_loading(verbosity, || Plan::new(&source, divided.experiment()?, methods))?;
    divided.check(&mut plan)?;
    let origin = shards::origin(threads);
    let hash = blake3::Hash::from_hex(&divided.hash).unwrap_or(blake3::Hash::from_bytes([0; blake3::OUT_LEN]));
    let growing = Growing::open(&place, Head { plan: hash, shard, origin }, args.fresh)?;
    let (seconds, _) = divided.estimate(shard);
    let progress = Progress::new(seconds, verbosity);
    let mut renderer = Renderer { divided: &divided, shard, growing, progress, stop };
    pool.install(|| renderer.all(&mut plan))?;
    let mut growing = renderer.growing;
    if let Some(signal) = stop.signal() {
        growing.flush()?;
        let done: u32 = growing.places().iter().map(Place::replicates).sum();
        let all: usize = (0..divided.units.len()).map(|unit| divided.replicates(shard, unit).len()).sum();
        tell!(
            "stopped early: {done} of {all} replicates of shard {shard} are kept; the same command goes on from there"
        );
        return Ok(Status::Interrupted(signal));
    }
    check_stands(&folder, &divided)?;
    growing.finish()?;
    said(verbosity, &format!("shard {shard} of {} is complete: {}\n", divided.count(), place.display()))
}

fn said(verbosity: Verbosity, text: &str) -> Result<Status, Error> {
    if verbosity == Verbosity::Normal {
        print(text)?;
    }
    Ok(Status::Done)
}

/// Whether a shard's file is there and whole.
fn is_complete(place: &Path, divided: &ShardPlan, shard: u32) -> bool {
    file::scan(place, Look::Bytes).is_ok_and(|contents| {
        let ours = contents.head.plan.to_hex().as_str() == divided.hash && contents.head.shard == shard;
        let held = contents.places.iter().map(Place::content);
        ours && contents.fault.is_none() && held.eq(divided.contents(shard))
    })
}

/// Refuses to put a shard among those of a plan that was made while it was rendered.
fn check_stands(folder: &Path, divided: &ShardPlan) -> Result<(), Error> {
    match ShardPlan::read(folder) {
        Ok(now) if now.hash == divided.hash => Ok(()),
        _ => Err(Error::usage(format!(
            "another plan was made in {} while this shard was rendered, which is of no use to it; run the shards of the new plan",
            folder.display()
        ))),
    }
}

/// A shard at work.
struct Renderer<'a> {
    divided: &'a ShardPlan,
    shard: u32,
    growing: Growing,
    progress: Progress,
    stop: &'a Stop,
}

impl Renderer<'_> {
    /// Renders what is not complete, until the user asks for an end.
    fn all(&mut self, plan: &mut Plan) -> Result<(), Error> {
        let mut number = 0;
        works::visit(plan, &mut |task: Task| {
            let unit = number;
            number += 1;
            let replicates = self.divided.replicates(self.shard, unit);
            let places = self.growing.places().iter().filter(|place| place.unit as usize == unit);
            let done: u32 = places.map(Place::replicates).sum();
            let left = replicates.start + done..replicates.end;
            self.progress.skip(f64::from(done) * self.divided.units[unit].seconds);
            if left.is_empty() || self.stop.signal().is_some() {
                return Ok(());
            }
            match task {
                Task::Render(work, _) => self.render(&work, unit, left),
                Task::Integrals { sampler, settings, samples, seed } => {
                    self.progress.say(self.divided.units[unit].name.clone());
                    let mut bytes = Vec::new();
                    let measured = self.progress.during(self.divided.units[unit].seconds, |_| {
                        integrals::write_checkpoint(sampler, settings, samples, seed, &mut bytes)
                    });
                    measured.map_err(|e| Error::usage(e.to_string()))?;
                    self.growing.append((unit as u32, 0, 0), &bytes)
                }
            }
        })
    }

    /// Renders replicates of one unit, each of which goes to the file at once.
    fn render(&mut self, work: &Work, unit: usize, replicates: Range<u32>) -> Result<(), Error> {
        let mut render = work.render()?;
        let divided = self.divided;
        let UnitOfWork { name, replicates: end, one_by_one, seconds: estimate, .. } = &divided.units[unit];
        self.take_up(&mut render, replicates.start, *one_by_one)?;
        let mut bytes = Vec::new();
        for replicate in replicates {
            self.progress.say(format!("{name}, {} of {end}", replicate + 1));
            let seconds = self.progress.during(*estimate, |report| render.run_apart(replicate, report));
            bytes.clear();
            render.write_replicate(seconds, &mut bytes).map_err(|e| Error::usage(e.to_string()))?;
            self.growing.append((unit as u32, replicate, 0), &bytes)?;
            if replicate >= *one_by_one {
                render.gather_replicate(seconds);
                let gathered = replicate % GROUP + 1;
                if gathered == GROUP || replicate + 1 == *end {
                    bytes.clear();
                    render.write_group(&mut bytes).map_err(|e| Error::usage(e.to_string()))?;
                    self.growing.gather(gathered, &bytes)?;
                }
            }
            if self.stop.signal().is_some() {
                break;
            }
        }
        Ok(())
    }

    /// Reads what an earlier process has left of the group that goes on with this replicate.
    fn take_up(&self, render: &mut Render, next: u32, one_by_one: u32) -> Result<(), Error> {
        let begun = (next % GROUP) as usize;
        let places = self.growing.places();
        if next >= one_by_one {
            // All of it is to be added up.
            return places[places.len() - begun..].iter().try_for_each(|place| {
                self.growing.read(place, |from| {
                    let seconds = render.read_replicate(from)?;
                    render.gather_replicate(seconds);
                    Ok(())
                })
            });
        }
        // A replicate's counts go on from those before it in its group.
        match places.last().filter(|_| begun > 0) {
            Some(place) => self.growing.read(place, |from| render.read_replicate(from).map(drop)),
            None => Ok(()),
        }
    }
}
