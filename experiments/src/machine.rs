//! What the operating system tells: memory, processor, clock.

use crate::error::Error;
use crate::result::Machine;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// The program's version, with a hash of its sources.
pub const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "+", env!("NEUMANN_BUILD"));

/// The machine, for manifests.
pub fn machine(threads: usize) -> Machine {
    Machine {
        platform: format!("{}-{}", std::env::consts::OS, std::env::consts::ARCH),
        cpu: field_of("/proc/cpuinfo", "model name").unwrap_or_default(),
        threads,
        kernels: scenes::Kernel::default().to_string(),
    }
}

/// The most memory that the process has held so far \[bytes\]; `None` where the system doesn't tell.
pub fn peak_memory() -> Option<u64> {
    kilobytes("/proc/self/status", "VmHWM")
}

/// The memory that the process holds now \[bytes\]; `None` where the system doesn't tell.
pub fn resident_memory() -> Option<u64> {
    kilobytes("/proc/self/status", "VmRSS")
}

/// Refuses work whose film needs more memory \[bytes\] than is free.
///
/// # Errors
/// A sentence with both numbers.
pub fn require_memory(needed: u128, what: &str) -> Result<(), Error> {
    let available = kilobytes("/proc/meminfo", "MemAvailable").unwrap_or(u64::MAX);
    if needed <= u128::from(available.min(isize::MAX as u64)) {
        return Ok(());
    }
    Err(Error::usage(format!(
        "{what} needs {} of memory, but {} are free; ask for a smaller --size, a lower --max-order or fewer --orders",
        gigabytes(needed),
        gigabytes(u128::from(available)),
    )))
}

/// When something began, by the calendar and by a clock that is never set.
#[derive(Clone, Copy, Debug)]
pub struct Began {
    calendar: SystemTime,
    clock: Instant,
}

impl Began {
    /// Begins now.
    pub fn now() -> Self {
        Self { calendar: SystemTime::now(), clock: Instant::now() }
    }

    /// The time of its beginning, the time now as if the calendar had not been set since, and the seconds between the two.
    pub fn until_now(self) -> (String, String, f64) {
        let passed = self.clock.elapsed();
        (timestamp(self.calendar), timestamp(self.calendar + passed), passed.as_secs_f64())
    }
}

/// Time in UTC, as `2026-01-31T12:00:00Z`.
pub fn timestamp(time: SystemTime) -> String {
    let seconds = time.duration_since(UNIX_EPOCH).map(|d| d.as_secs()).unwrap_or_default();
    let (year, month, day) = civil_date(seconds / 86_400);
    let of_day = seconds % 86_400;
    format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z", of_day / 3600, of_day / 60 % 60, of_day % 60)
}

/// The Gregorian date of a number of days since 1970-01-01. Years are counted from March, so that leap days come last.
fn civil_date(days: u64) -> (u64, u64, u64) {
    let days = days + 719_468;
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * of_year + 2) / 153;
    let day = of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    (era * 400 + year_of_era + u64::from(month <= 2), month, day)
}

fn gigabytes(bytes: u128) -> String {
    format!("{:.1} GB", bytes as f64 / 1e9)
}

fn kilobytes(file: &str, key: &str) -> Option<u64> {
    let value = field_of(file, key)?;
    Some(value.trim_end_matches("kB").trim().parse::<u64>().ok()? * 1024)
}

/// The value of the first line `key: value` of a file.
fn field_of(file: &str, key: &str) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find(|line| line.starts_with(key))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn what_began_under_another_date_ends_after_it() {
        // The calendar was set back by a day since.
        let calendar = SystemTime::now() + Duration::from_secs(86_400);
        let (started, ended, seconds) = Began { calendar, clock: Instant::now() }.until_now();
        assert!(started <= ended && (0.0..60.0).contains(&seconds), "{started} {ended} {seconds}");
    }

    #[test]
    fn dates_are_gregorian() {
        let at = |seconds| timestamp(UNIX_EPOCH + Duration::from_secs(seconds));
        assert_eq!(at(0), "1970-01-01T00:00:00Z");
        assert_eq!(at(951_782_400), "2000-02-29T00:00:00Z");
        assert_eq!(at(1_769_860_799), "2026-01-31T11:59:59Z");
        assert_eq!(at(4_107_542_400), "2100-03-01T00:00:00Z");
    }

    #[test]
    fn memory_beyond_the_machine_is_refused() {
        assert!(require_memory(1 << 20, "a render").is_ok());
        let message = require_memory(1 << 80, "a render").unwrap_err().to_string();
        assert!(message.contains("--size"), "{message}");
    }
}
