//! `plan.json`: what all shards of an experiment are, written once and read by every one of them.

use super::{FOLDER, Foreign, difference};
use crate::config::Experiment;
use crate::error::Error;
use crate::export::write_atomically;
use crate::plan::Plan;
use crate::result::Origin;
use crate::runner::works::{self, Task};
use crate::source::Source;
use integrators::statistics::GROUP;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The plan's file, in the folder of results.
pub const FILE: &str = "plan.json";
/// The format that is written, and the only one that is read.
const FORMAT: u32 = 2;

/// An experiment, divided.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ShardPlan {
    /// The format.
    pub format: u32,
    /// BLAKE3 of all that numbers follow from: experiment, program, architecture, units of work, and who renders what.
    pub hash: String,
    /// The experiment's name.
    pub name: String,
    /// Its file; `None` for a built-in.
    pub path: Option<PathBuf>,
    /// What that held.
    pub text: String,
    /// The experiment with the changes that flags made, as TOML.
    pub experiment: String,
    /// Who made the plan.
    pub origin: Origin,
    /// All that is to be rendered.
    pub units: Vec<UnitOfWork>,
    /// Who renders what.
    pub shards: Vec<Share>,
}

/// Replicates of one method in one scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnitOfWork {
    /// What it is called.
    pub name: String,
    /// The hash of what its numbers follow from, the program apart.
    pub content: String,
    /// Replicates.
    pub replicates: u32,
    /// How many of them, the first, are kept one by one; of those after them the moments of groups are.
    pub one_by_one: u32,
    /// What a replicate probably takes \[s\].
    pub seconds: f64,
    /// The size of a replicate in a file \[bytes\].
    pub bytes: u64,
}

impl UnitOfWork {
    fn groups(&self) -> u32 {
        self.replicates.div_ceil(GROUP)
    }

    /// Replicates in some of its groups.
    fn replicates_in(&self, groups: &Range<u32>) -> Range<u32> {
        (groups.start * GROUP).min(self.replicates)..(groups.end * GROUP).min(self.replicates)
    }

    /// Those in a range of groups that are counted from the plan's first, of which so many come before its own.
    fn replicates_of(&self, before: u64, groups: &Range<u64>) -> Range<u32> {
        let inside = |group: u64| group.saturating_sub(before).min(u64::from(self.groups())) as u32;
        self.replicates_in(&(inside(groups.start)..inside(groups.end)))
    }

    /// What a file holds of these replicates: the first of each record, and 0 or how many have been added up in it.
    fn records(&self, replicates: Range<u32>) -> impl Iterator<Item = (u32, u32)> + use<> {
        let middle = self.one_by_one.clamp(replicates.start, replicates.end);
        let groups = (middle..replicates.end).step_by(GROUP as usize);
        let group = move |first: u32| (first, GROUP.min(replicates.end - first));
        (replicates.start..middle).map(|replicate| (replicate, 0)).chain(groups.map(group))
    }

    /// What a group probably takes \[s\].
    fn group_seconds(&self) -> impl Iterator<Item = f64> {
        (0..self.groups()).map(|group| self.replicates_in(&(group..group + 1)).len() as f64 * self.seconds)
    }
}

/// What one shard renders: a range of groups of replicates, counted through all units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Share {
    /// The first one.
    pub first: u64,
    /// The one after the last.
    pub end: u64,
}

impl ShardPlan {
    /// A plan of so many shards of similar length.
    ///
    /// # Errors
    /// If there are fewer groups of replicates than that.
    pub fn new(
        source: &Source,
        experiment: &Experiment,
        origin: Origin,
        units: Vec<UnitOfWork>,
        shards: u32,
    ) -> Result<Self, Error> {
        let costs: Vec<f64> = units.iter().flat_map(UnitOfWork::group_seconds).collect();
        if costs.len() < shards as usize {
            let most = costs.len();
            return Err(Error::usage(format!(
                "there are {most} groups of {GROUP} replicates to be rendered, too few for {shards} shards; ask for at most --shards \
                 {most}, or for more --replicates"
            )));
        }
        let experiment = toml::to_string(experiment).map_err(|e| Error::usage(e.to_string()))?;
        let (name, path, text) = (source.name.clone(), source.path.clone(), source.text().to_owned());
        let path = path.map(|path| std::path::absolute(&path).unwrap_or(path));
        let shards = cut(&costs, shards as usize);
        let mut plan =
            Self { format: FORMAT, hash: String::new(), name, path, text, experiment, origin, units, shards };
        plan.hash = plan.hashed();
        Ok(plan)
    }

    /// The plan in a folder of results.
    ///
    /// # Errors
    /// If there is none, or it is damaged or of another format.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(FILE);
        let bytes = scenes::file::read(&path).map_err(|source| Error::Io {
            action: "read",
            path: path.clone(),
            source,
            mend: "make a plan first, by `neumann plan EXPERIMENT --shards N --out DIR`",
        })?;
        let plan = serde_json::from_slice::<Self>(&bytes).ok().filter(|plan| plan.format == FORMAT);
        plan.filter(|plan| plan.hash == plan.hashed()).ok_or_else(|| {
            let message = "it is damaged, or of another version; put a copy of it back, if there is one, or plan anew: in \
                           another folder, or here with --fresh, which discards the shards";
            Error::File { file: path, line: None, message: message.to_owned() }
        })
    }

    /// Writes it to a folder of results.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        let text = serde_json::to_string_pretty(self).unwrap_or_default() + "\n";
        Ok(write_atomically(&folder.join(FILE), text.as_bytes())?)
    }

    /// The hash of all but where the experiment's file lies and what work costs.
    fn hashed(&self) -> String {
        let Self { format, name, text, experiment, origin, units, shards, .. } = self;
        let units: Vec<_> =
            units.iter().map(|unit| (&unit.name, &unit.content, unit.replicates, unit.one_by_one)).collect();
        let kind = (&origin.neumann, &origin.program, &origin.machine.platform, &origin.machine.kernels);
        let told = serde_json::to_string(&(format, name, text, experiment, kind, units, shards)).unwrap_or_default();
        blake3::hash(told.as_bytes()).to_hex().to_string()
    }

    /// The experiment's file, as it was.
    pub fn source(&self) -> Source {
        Source::known(&self.name, self.path.clone(), &self.text)
    }

    /// The experiment, changes by flags included.
    ///
    /// # Errors
    /// If another version wrote it.
    pub fn experiment(&self) -> Result<Experiment, Error> {
        let message = |e: toml::de::Error| format!("the plan's experiment cannot be read: {e}; plan anew");
        toml::from_str(&self.experiment).map_err(|e| Error::usage(message(e)))
    }

    /// How many shards there are.
    pub fn count(&self) -> u32 {
        self.shards.len() as u32
    }

    /// Replicates of a unit that a shard renders; shards count from 1.
    pub fn replicates(&self, shard: u32, unit: usize) -> Range<u32> {
        let Share { first, end } = self.shards[shard as usize - 1];
        let before: u64 = self.units[..unit].iter().map(|unit| u64::from(unit.groups())).sum();
        self.units[unit].replicates_of(before, &(first..end))
    }

    /// What a shard holds, as [`Place::content`](super::file::Place::content) tells it.
    pub fn contents(&self, shard: u32) -> impl Iterator<Item = (u32, u32, u32)> {
        let Share { first, end } = self.shards[shard as usize - 1];
        let mut before = 0;
        self.units.iter().enumerate().flat_map(move |(i, unit)| {
            let replicates = unit.replicates_of(before, &(first..end));
            before += u64::from(unit.groups());
            unit.records(replicates).map(move |(replicate, gathered)| (i as u32, replicate, gathered))
        })
    }

    /// Seconds that a shard probably takes, and the bytes of its file.
    pub fn estimate(&self, shard: u32) -> (f64, u64) {
        let of = |(i, unit): (usize, &UnitOfWork)| {
            let replicates = self.replicates(shard, i);
            // Of a group there are means and squared deviations.
            let bytes = |(_, gathered): (u32, u32)| if gathered > 0 { 2 * unit.bytes } else { unit.bytes };
            (replicates.len() as f64 * unit.seconds, unit.records(replicates).map(bytes).sum::<u64>())
        };
        self.units.iter().enumerate().map(of).fold((0.0, 0), |sum, x| (sum.0 + x.0, sum.1 + x.1))
    }

    /// Refuses an experiment's file that is not what the plan was made of.
    ///
    /// # Errors
    /// If it was edited, or is another one.
    pub fn check_source(&self, source: &Source) -> Result<(), Error> {
        if source.text() == self.text {
            return Ok(());
        }
        let message = "it is not what the plan was made of; undo that, or plan anew in another folder or with --fresh";
        Err(source.blame("", message.to_owned()))
    }

    /// Refuses an experiment that is not the plan's any more: its file or one of its scenes was edited.
    ///
    /// # Errors
    /// If something differs, with what that is.
    pub fn check(&self, plan: &mut Plan) -> Result<(), Error> {
        let changed = |what: String| {
            Error::usage(format!(
                "{what} since the plan was made; undo that, or plan anew in another folder or with --fresh"
            ))
        };
        let mut number = 0;
        works::visit(plan, &mut |task: Task| {
            let planned = self.units.get(number);
            number += 1;
            let content = task.content().to_hex();
            match planned {
                Some(unit)
                    if unit.content == *content
                        && (unit.replicates, unit.one_by_one) == (task.replicates(), task.one_by_one()) =>
                {
                    Ok(())
                }
                _ => Err(changed(format!("what {} follows from was edited", task.name()))),
            }
        })?;
        match number == self.units.len() {
            true => Ok(()),
            false => Err(changed("the experiment was edited".to_owned())),
        }
    }

    /// How a plan differs in its question from another one, whatever it says of who renders what; `None` if it does not.
    pub fn other_question(&self, other: &Self) -> Option<String> {
        let units = |plan: &Self| -> Vec<(String, u32)> {
            plan.units.iter().map(|unit| (unit.content.clone(), unit.replicates)).collect()
        };
        let here = difference(&other.origin, &self.origin, Foreign::Refused);
        here.or_else(|| {
            let same = (&self.experiment, &self.text, units(self)) == (&other.experiment, &other.text, units(other));
            (!same).then(|| "of another experiment, or of one that was edited".to_owned())
        })
    }

    /// Where a shard's file is, among results.
    pub fn file(&self, folder: &Path, shard: u32) -> PathBuf {
        folder.join(FOLDER).join(format!("{shard:04}_of_{:04}.shard", self.count()))
    }

    /// The command that renders a shard.
    pub fn command(&self, folder: &Path, shard: u32) -> String {
        format!("{} --shard {shard}/{}", self.command_of_all(folder), self.count())
    }

    /// The same without saying which shard.
    pub fn command_of_all(&self, folder: &Path) -> String {
        let experiment = self.path.as_deref().map_or(self.name.clone(), |path| quoted(&path.to_string_lossy()));
        format!("neumann run {experiment} --out {}", quoted(&folder.to_string_lossy()))
    }
}

/// A word as shells read it.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:,@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// Cuts costs into so many ranges that follow one another, none of them empty, of similar sums.
fn cut(costs: &[f64], parts: usize) -> Vec<Share> {
    let mut left: f64 = costs.iter().sum();
    let (mut shares, mut first) = (Vec::new(), 0);
    for part in 0..parts {
        let others = parts - part - 1;
        let aim = left / (others + 1) as f64;
        let (mut end, mut sum) = (first + 1, costs[first]);
        // One more, as long as that comes nearer and enough are left for the others.
        while end + others < costs.len() && (others == 0 || sum + 0.5 * costs[end] < aim) {
            sum += costs[end];
            end += 1;
        }
        left -= sum;
        shares.push(Share { first: first as u64, end: end as u64 });
        first = end;
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sums(costs: &[f64], parts: usize) -> Vec<f64> {
        let shares = cut(costs, parts);
        let ends: Vec<u64> = shares.iter().map(|share| share.end).collect();
        let starts: Vec<u64> = shares.iter().map(|share| share.first).collect();
        assert_eq!((starts[0], ends[parts - 1]), (0, costs.len() as u64));
        assert!(starts[1..] == ends[..parts - 1] && shares.iter().all(|share| share.first < share.end));
        shares.iter().map(|share| costs[share.first as usize..share.end as usize].iter().sum()).collect()
    }

    #[test]
    fn shards_are_of_similar_length_and_none_is_empty() {
        assert_eq!(sums(&[1.0; 12], 4), [3.0; 4]);
        assert_eq!(sums(&[1.0; 3], 3), [1.0; 3]);
        assert_eq!(sums(&[8.0, 1.0, 1.0, 1.0, 1.0, 4.0], 3), [8.0, 4.0, 4.0]);
        assert_eq!(sums(&[1.0, 1.0, 100.0], 3), [1.0, 1.0, 100.0]);
        assert_eq!(sums(&[0.0; 5], 2).len(), 2);
        let costs: Vec<f64> = (0..1000).map(|i| 1.0 + f64::from(i % 7)).collect();
        assert!(sums(&costs, 20).iter().all(|sum| (sum - 200.0).abs() <= 8.0));
    }

    #[test]
    fn of_later_replicates_groups_are_kept() {
        let (name, content) = (String::new(), String::new());
        let unit = UnitOfWork { name, content, replicates: 29, one_by_one: 16, seconds: 1.0, bytes: 1 };
        let records = |replicates: Range<u32>| unit.records(replicates).collect::<Vec<_>>();
        assert_eq!(records(8..16), (8..16).map(|replicate| (replicate, 0)).collect::<Vec<_>>());
        assert_eq!(records(16..29), [(16, 8), (24, 5)]);
        assert_eq!(records(8..24)[7..], [(15, 0), (16, 8)]);
        assert_eq!(records(24..29), [(24, 5)]);
        assert!(records(29..29).is_empty());
    }

    #[test]
    fn words_are_quoted_for_shells() {
        assert_eq!(["a/b.toml", "my file", "it's", ""].map(quoted), ["a/b.toml", "'my file'", "'it'\\''s'", "''"]);
    }
}
