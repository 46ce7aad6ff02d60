//! Faults that can be injected, to prove that the tests would notice them.
//!
//! A fault is written where a programmer would make it: `fault!("name", sound, faulty)`. In a normal build the macro is its
//! sound side and nothing else. In a build with `--cfg mutate` the environment variable `NEUMANN_FAULT` names the one
//! fault that is active; `tests/faults.rs` lists them all, each with the test that must fail under it.

/// Its second argument, unless the build has `--cfg mutate` and the named fault is injected: then its third.
#[macro_export]
macro_rules! fault {
    ($name:literal, $sound:expr, $faulty:expr) => {{
        #[cfg(not(mutate))]
        let value = $sound;
        #[cfg(mutate)]
        let value = if $crate::fault::is_injected($name) { $faulty } else { $sound };
        value
    }};
}

/// Whether `NEUMANN_FAULT` names this fault.
#[cfg(mutate)]
pub fn is_injected(name: &str) -> bool {
    static INJECTED: std::sync::LazyLock<Option<String>> =
        std::sync::LazyLock::new(|| std::env::var("NEUMANN_FAULT").ok());
    INJECTED.as_deref() == Some(name)
}
