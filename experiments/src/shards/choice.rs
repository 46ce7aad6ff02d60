//! Which shard a process is to render.

use crate::error::Error;
use std::str::FromStr;

/// A shard's number as it was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShardChoice {
    /// This one of so many, from 1.
    Number(u32, u32),
    /// As the engine says that started the process.
    Auto,
}

/// Where engines say which task of an array a process is, and the number of the first one.
const ENGINES: [(&str, u32); 4] =
    [("SLURM_ARRAY_TASK_ID", 1), ("JOB_COMPLETION_INDEX", 0), ("PBS_ARRAY_INDEX", 1), ("SGE_TASK_ID", 1)];

impl FromStr for ShardChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let parts = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((i, n)) if (1..=n).contains(&i) => Ok(Self::Number(i, n)),
            Some((_, n)) if n > 0 => Err(format!("shards are numbered from 1 to {n}")),
            _ => Err("give a shard's number and how many there are, such as 3/8, or auto".to_owned()),
        }
    }
}

impl ShardChoice {
    /// The shard's number from 1, of a plan of so many. `variable` looks up what the environment holds.
    ///
    /// # Errors
    /// If the plan has another number of shards, no engine says a number, or it is one that the plan has not.
    pub fn number(self, shards: u32, variable: impl Fn(&str) -> Option<String>) -> Result<u32, Error> {
        if let Self::Number(i, n) = self {
            return match n == shards {
                true => Ok(i),
                false => Err(Error::usage(format!(
                    "the plan has {shards} shards, not {n}; ask for one of --shard 1/{shards} to {shards}/{shards}"
                ))),
            };
        }
        // SGE says `undefined` outside arrays.
        let told = ENGINES.iter().find_map(|&(name, first)| {
            let text = variable(name).filter(|text| text != "undefined" && !text.is_empty())?;
            Some((name, first, text))
        });
        let Some((name, first, text)) = told else {
            let names: Vec<&str> = ENGINES.iter().map(|(name, _)| *name).collect();
            let names = names.join(", ");
            return Err(Error::usage(format!(
                "--shard auto finds none of {names}; say which one, such as --shard 1/{shards}"
            )));
        };
        let last = first + shards - 1;
        match text.parse::<u32>() {
            Ok(task) if (first..=last).contains(&task) => Ok(task - first + 1),
            _ => Err(Error::usage(format!(
                "{name} is {text}, but the {shards} shards of the plan are tasks {first} to {last}; submit an array of these"
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_count_from_one() {
        assert_eq!("3/8".parse(), Ok(ShardChoice::Number(3, 8)));
        assert_eq!("auto".parse(), Ok(ShardChoice::Auto));
        for (text, word) in
            [("0/8", "from 1 to 8"), ("9/8", "from 1 to 8"), ("3", "3/8"), ("0/0", "3/8"), ("-1/4", "3/8")]
        {
            assert!(text.parse::<ShardChoice>().unwrap_err().contains(word), "{text}");
        }
        let message = ShardChoice::Number(3, 8).number(6, |_| None).unwrap_err().to_string();
        assert!(message.contains("the plan has 6 shards, not 8"), "{message}");
    }

    #[test]
    fn every_engine_says_which_task_it_is() {
        let auto = |name: &'static str, value: &'static str| {
            ShardChoice::Auto.number(4, move |asked| (asked == name).then(|| value.to_owned()))
        };
        let numbers = |name, values: [&'static str; 2]| values.map(|value| auto(name, value).unwrap());
        assert_eq!(numbers("SLURM_ARRAY_TASK_ID", ["1", "4"]), [1, 4]);
        assert_eq!(numbers("PBS_ARRAY_INDEX", ["1", "4"]), [1, 4]);
        assert_eq!(numbers("SGE_TASK_ID", ["1", "4"]), [1, 4]);
        assert_eq!(numbers("JOB_COMPLETION_INDEX", ["0", "3"]), [1, 4]);
        let message = |name, value| auto(name, value).unwrap_err().to_string();
        assert!(message("SLURM_ARRAY_TASK_ID", "0").contains("tasks 1 to 4"));
        assert!(message("JOB_COMPLETION_INDEX", "4").contains("tasks 0 to 3"));
        assert!(message("SGE_TASK_ID", "undefined").contains("--shard 1/4"));
    }
}
