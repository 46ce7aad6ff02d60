//! What a merge of very many shards costs, without rendering them: the shards of a plan that are missing, with copies of what others hold.
//!
//! ```console
//! $ neumann plan e.toml --shards 10000 --out big              # few samples, many replicates
//! $ neumann run e.toml --out big --shard 1/10000              # replicates one by one
//! $ neumann run e.toml --out big --shard 33/10000             # a group as moments
//! $ cargo run --release --example many_shards -- big          # all others
//! $ /usr/bin/time -v neumann merge big                        # the seconds and the memory are real, the image is not
//! ```
//!
//! A shard that is made here has the size of one that was rendered, and its hashes fit. It is written as a shard is: a file created, locked, flushed and
//! renamed, so that what the file system bears is measured as well.

use neumann::shards::ShardPlan;
use neumann::shards::file::{Head, Look, read_record, scan};
use neumann::shards::growing::Growing;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::error::Error;
use std::fs::File;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

fn main() -> ExitCode {
    let Some(folder) = std::env::args().nth(1) else {
        eprintln!("error: name the folder of a plan");
        return ExitCode::from(2);
    };
    match fill(Path::new(&folder)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Makes all shards that are missing.
fn fill(folder: &Path) -> Result<(), Box<dyn Error>> {
    let plan = ShardPlan::read(folder)?;
    let (there, missing): (Vec<u32>, Vec<u32>) =
        (1..=plan.count()).partition(|&shard| plan.file(folder, shard).exists());
    // By unit and kind.
    let mut known: HashMap<(u32, u32), Vec<u8>> = HashMap::new();
    let mut origin = None;
    for shard in there {
        let path = plan.file(folder, shard);
        let (contents, mut file) = (scan(&path, Look::Records)?, File::open(&path)?);
        for place in &contents.places {
            if let Entry::Vacant(kind) = known.entry((place.unit, place.gathered)) {
                read_record(&mut file, place, kind.insert(Vec::new()))?;
            }
        }
        origin = Some(contents.head.origin);
    }
    let origin = origin.ok_or("no shard is there to be copied; render one, by neumann run --shard")?;
    let (start, mut written) = (Instant::now(), 0);
    for &shard in &missing {
        let head = Head { plan: blake3::Hash::from_hex(&plan.hash)?, shard, origin: origin.clone() };
        let mut growing = Growing::open(&plan.file(folder, shard), head, true)?;
        for (unit, replicate, gathered) in plan.contents(shard) {
            let bytes = known.get(&(unit, gathered)).ok_or_else(|| {
                format!("nothing is known that shard {shard} could hold; render it: {}", plan.command(folder, shard))
            })?;
            growing.append((unit, replicate, gathered), bytes)?;
            written += bytes.len();
        }
        growing.finish()?;
    }
    let (shards, seconds) = (missing.len(), start.elapsed().as_secs_f64());
    println!("{shards} shards of {:.1} MB in all were written in {seconds:.1} s", written as f64 / 1e6);
    Ok(())
}
