//! Shards of an experiment.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::shard(bytes));
