//! What a render needs to go on later, as bytes.
//!
//! Numbers are little-endian, an `f64` is its bits, a list is led by its length (`u64`), what may be missing by a byte 0 or 1. A struct
//! is its fields in the order in which [`stored!`](crate::stored) names them. Nothing here tells what the bytes are of, or
//! whether they are whole: who keeps them does.

use std::io::{self, Read, Write};

/// What can be written as bytes, and read back to the same bits.
pub trait Stored: Sized {
    /// Appends it.
    ///
    /// # Errors
    /// If it cannot be written.
    fn write(&self, to: &mut dyn Write) -> io::Result<()>;

    /// Reads it.
    ///
    /// # Errors
    /// If the bytes end too early, or are none that [`Stored::write`] leaves.
    fn read(from: &mut dyn Read) -> io::Result<Self>;
}

/// Makes a struct of which every field is [`Stored`] such a one: its name, and all of its fields.
#[macro_export]
macro_rules! stored {
    ($name:ident { $($field:ident),+ $(,)? }) => {
        impl $crate::state::Stored for $name {
            fn write(&self, to: &mut dyn std::io::Write) -> std::io::Result<()> {
                $($crate::state::Stored::write(&self.$field, to)?;)+
                Ok(())
            }

            fn read(from: &mut dyn std::io::Read) -> std::io::Result<Self> {
                Ok(Self { $($field: $crate::state::Stored::read(from)?),+ })
            }
        }
    };
}

macro_rules! stored_numbers {
    ($($number:ty),+) => {$(
        impl Stored for $number {
            fn write(&self, to: &mut dyn Write) -> io::Result<()> {
                to.write_all(&self.to_le_bytes())
            }

            fn read(from: &mut dyn Read) -> io::Result<Self> {
                let mut bytes = [0; size_of::<Self>()];
                from.read_exact(&mut bytes)?;
                Ok(Self::from_le_bytes(bytes))
            }
        }
    )+};
}

stored_numbers!(u8, u32, u64, f64);

impl Stored for usize {
    fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        (*self as u64).write(to)
    }

    fn read(from: &mut dyn Read) -> io::Result<Self> {
        u64::read(from)?.try_into().map_err(|_| damaged("a length beyond all memory"))
    }
}

impl<T: Stored + Copy + Default, const N: usize> Stored for [T; N] {
    fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        self.iter().try_for_each(|value| value.write(to))
    }

    fn read(from: &mut dyn Read) -> io::Result<Self> {
        let mut values = [T::default(); N];
        for value in &mut values {
            *value = T::read(from)?;
        }
        Ok(values)
    }
}

impl<T: Stored> Stored for Vec<T> {
    fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        self.len().write(to)?;
        self.iter().try_for_each(|value| value.write(to))
    }

    fn read(from: &mut dyn Read) -> io::Result<Self> {
        /// What is reserved at once: a wrong length shall end with the bytes, and not with the memory.
        const PIECE: usize = 1 << 16;
        let length = usize::read(from)?;
        let mut values = Self::with_capacity(length.min(PIECE));
        for _ in 0..length {
            values.push(T::read(from)?);
        }
        Ok(values)
    }
}

impl<T: Stored> Stored for Option<T> {
    fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        u8::from(self.is_some()).write(to)?;
        self.as_ref().map_or(Ok(()), |value| value.write(to))
    }

    fn read(from: &mut dyn Read) -> io::Result<Self> {
        match u8::read(from)? {
            0 => Ok(None),
            1 => T::read(from).map(Some),
            _ => Err(damaged("neither something nor nothing")),
        }
    }
}

/// The error about bytes that are none of ours.
pub fn damaged(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq)]
    struct Sample {
        numbers: Vec<[f64; 3]>,
        count: u32,
        lists: Vec<Vec<u64>>,
        perhaps: Option<f64>,
        not: Option<u8>,
    }
    stored!(Sample { numbers, count, lists, perhaps, not });

    fn bytes() -> (Sample, Vec<u8>) {
        let numbers = vec![[0.1, -0.0, f64::MIN_POSITIVE], [f64::INFINITY, 1e-310, 3.0]];
        let lists = vec![vec![], vec![u64::MAX, 1]];
        let sample = Sample { numbers, count: 7, lists, perhaps: Some(2.5), not: None };
        let mut bytes = Vec::new();
        sample.write(&mut bytes).unwrap();
        (sample, bytes)
    }

    #[test]
    fn what_is_read_is_what_was_written() {
        let (sample, bytes) = bytes();
        let read = Sample::read(&mut bytes.as_slice()).unwrap();
        assert_eq!(read, sample);
        assert_eq!(read.numbers[0][1].to_bits(), (-0.0_f64).to_bits());
        assert_eq!(bytes.len(), 8 + 48 + 4 + 8 + 8 + 24 + 9 + 1);
    }

    #[test]
    fn bytes_that_end_too_early_are_an_error() {
        let (_, bytes) = bytes();
        for length in 0..bytes.len() {
            assert!(Sample::read(&mut &bytes[..length]).is_err(), "{length} bytes");
        }
        let lengths = [0xff; 16];
        assert!(<Vec<f64>>::read(&mut lengths.as_slice()).is_err());
        assert!(<Option<f64>>::read(&mut lengths.as_slice()).is_err());
    }
}
