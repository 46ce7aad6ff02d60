//! Processor time: what other programs on the machine take of it is not counted.

/// Seconds that the processor spent on a piece of work of this thread; where the system doesn't tell, those that went by.
pub(super) fn spent(work: impl FnOnce()) -> f64 {
    let start = now();
    work();
    now() - start
}

#[cfg(unix)]
fn now() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

#[cfg(not(unix))]
fn now() -> f64 {
    use std::sync::OnceLock;
    use std::time::Instant;
    static BEGAN: OnceLock<Instant> = OnceLock::new();
    BEGAN.get_or_init(Instant::now).elapsed().as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    #[cfg(unix)]
    #[test]
    fn sleep_is_not_counted_and_work_is() {
        assert!(spent(|| std::thread::sleep(Duration::from_millis(50))) < 0.04);
        let busy = || {
            let start = Instant::now();
            while start.elapsed() < Duration::from_millis(20) {
                std::hint::spin_loop();
            }
        };
        assert!(spent(busy) > 0.0);
    }
}
