//! What stands behind flags, read.

use crate::config::HIGHEST_ORDER;
use integrators::Window;

pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parts = text.split_once(['x', 'X', '×']).and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match parts {
        Some((width, height)) if width > 0 && height > 0 => Ok((width, height)),
        Some(_) => Err("width and height must be at least 1; write for example 256x256".to_owned()),
        None => Err("this is no size; write width and height in pixels, for example 256x256".to_owned()),
    }
}

/// Four numbers, of which none can be checked against the image yet.
pub fn parse_crop(text: &str) -> Result<Window, String> {
    let numbers: Result<Vec<u32>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, width, height]) if width > 0 && height > 0 => {
            let end = |start: u32, length: u32| start.checked_add(length).ok_or("no image is that large");
            Ok(Window { x: x..end(x, width)?, y: y..end(y, height)? })
        }
        Ok([_, _, _, _]) => Err("width and height must be at least 1; write for example 32,16,64,64".to_owned()),
        _ => Err("give column and row of the first pixel, width and height, for example 32,16,64,64".to_owned()),
    }
}

/// The last order of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaxOrder {
    /// The lowest beyond which little enough is left.
    Auto,
    /// This one.
    Order(usize),
}

pub fn parse_max_order(text: &str) -> Result<MaxOrder, String> {
    match text {
        "auto" => Ok(MaxOrder::Auto),
        _ => text.parse().map(MaxOrder::Order).map_err(|_| "give an order such as 8, or auto".to_owned()),
    }
}

pub fn parse_order(text: &str) -> Result<usize, String> {
    order_from(0, text)
}

/// Fewer orders than four pairs do not tell how they fall.
pub fn parse_measured_order(text: &str) -> Result<usize, String> {
    order_from(7, text)
}

fn order_from(least: usize, text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(order) if (least..=HIGHEST_ORDER).contains(&order) => Ok(order),
        _ => Err(format!("give an order from {least} to {HIGHEST_ORDER}")),
    }
}

/// A part of a whole.
pub fn parse_part(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(part) if part > 0.0 && part < 1.0 => Ok(part),
        _ => {
            Err("this is no part such as 1e-3, between 0 and 1; where something else follows, write it before the flag"
                .to_owned())
        }
    }
}

pub fn parse_pair<T: std::str::FromStr>(text: &str) -> Result<(T, T), String> {
    let parts = text.split_once(',').and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
    parts.ok_or_else(|| "give two whole numbers with a comma between them, for example 12,40".to_owned())
}

/// How many samples, replicates, rounds and the like.
pub fn at_least<const LEAST: u32>(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(count) if count >= LEAST => Ok(count),
        _ => Err(format!("give a whole number from {LEAST} to {}, in digits", u32::MAX)),
    }
}

pub fn parse_seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("give a whole number from 0 to {}, in digits", u64::MAX))
}

/// A number of things, such as 1000 or 1e9.
pub fn parse_count(text: &str) -> Result<u64, String> {
    match text.parse::<f64>() {
        Ok(count) if (1.0..=1e15).contains(&count) && count.fract() == 0.0 => Ok(count as u64),
        _ => Err("give a whole number from 1 to 1e15, such as 1e9".to_owned()),
    }
}

/// More threads than any machine has would only fail later, without a reason that a user understands.
const MAX_THREADS: usize = 4096;

pub fn parse_threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(threads) if (1..=MAX_THREADS).contains(&threads) => Ok(threads),
        _ => Err(format!("give a number of threads from 1 to {MAX_THREADS}, or leave --threads out for all cores")),
    }
}

pub fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if seconds >= 0.0 => Ok(seconds),
        _ => Err("give a number of seconds, such as 60; 0 saves every replicate".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read() {
        assert_eq!(parse_size("640x480"), Ok((640, 480)));
        assert!(parse_size("0x480").unwrap_err().contains("at least 1"));
        assert!(parse_size("640").unwrap_err().contains("256x256"));
        assert!(parse_size("-1x4").is_err());
    }

    #[test]
    fn counts_are_read() {
        assert_eq!(parse_count("1e9"), Ok(1_000_000_000));
        assert_eq!(parse_count("12"), Ok(12));
        for text in ["0", "-1", "1.5", "many", "1e30", "nan"] {
            assert!(parse_count(text).unwrap_err().contains("1e9"), "{text}");
        }
    }

    #[test]
    fn crops_are_read() {
        assert_eq!(parse_crop("32, 16,64,48"), Ok(Window { x: 32..96, y: 16..64 }));
        assert!(parse_crop("1,2,0,3").unwrap_err().contains("at least 1"));
        for text in ["1,2,3", "1,2,3,4,5", "-1,2,3,4", "a"] {
            assert!(parse_crop(text).unwrap_err().contains("32,16,64,64"), "{text}");
        }
        assert!(parse_crop("4294967295,0,2,2").is_err());
    }
}
