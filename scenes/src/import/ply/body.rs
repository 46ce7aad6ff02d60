//! The numbers behind the header of a PLY file.

use super::header::{Element, Format, Header, Kind, Scalar};
use crate::error::SceneError;
use rayon::prelude::*;

/// What is wrong with one element.
#[derive(Debug)]
pub struct Fault {
    pub message: String,
    pub mend: String,
}

impl Fault {
    pub fn new(message: impl Into<String>, mend: impl Into<String>) -> Self {
        Fault { message: message.into(), mend: mend.into() }
    }

    #[cold]
    fn ended() -> Self {
        Fault::new("the file ends within it", "save it again, as a whole")
    }
}

/// Elements that are read in one go, by one thread.
const RUN: u64 = 1 << 14;

/// A file that is being read.
#[derive(Clone, Copy)]
pub struct Body<'a> {
    whole: &'a [u8],
    /// What is left of it.
    pub rest: &'a [u8],
    format: Format,
}

impl<'a> Body<'a> {
    /// What lies behind the header of a file.
    pub fn behind(header: &Header, whole: &'a [u8]) -> Self {
        Self { whole, rest: &whole[header.length..], format: header.format }
    }

    /// The line of what was read last, of a file that has lines.
    pub fn line(&self) -> Option<usize> {
        let read = &self.whole[..self.whole.len() - self.rest.len()];
        (self.format == Format::Ascii).then(|| 1 + read.iter().filter(|&&byte| byte == b'\n').count())
    }

    /// Says if the rest is too short for all of an element, however short its lists are.
    pub fn check_size(&self, element: &Element) -> Result<(), SceneError> {
        let least = |kind: Kind| match (self.format, kind) {
            // A digit and what parts it from the next.
            (Format::Ascii, _) => 2,
            (_, Kind::Scalar(scalar)) => scalar.size() as u128,
            (_, Kind::List { count, .. }) => count.size() as u128,
        };
        let size = u128::from(element.count) * element.properties.iter().map(|p| least(p.kind)).sum::<u128>();
        // Nothing need part the last number from what follows.
        if size > self.rest.len() as u128 + 1 {
            let message = format!("there are {} of them, for which the file is too short", element.count);
            return Err(element.error(&message, "save it again, as a whole"));
        }
        Ok(())
    }

    /// Reads an element by many threads: `read` makes something of a run of them, from the place where they begin, and `join` takes
    /// that in their order. `at` is told how much is left of the file.
    pub fn read_runs<T: Send>(
        &mut self,
        element: &Element,
        read: impl Fn(std::ops::Range<u64>, Body<'a>) -> Result<T, SceneError> + Sync,
        mut join: impl FnMut(T),
        at: impl Fn(usize),
    ) -> Result<(), SceneError> {
        let together = 4 * rayon::current_num_threads();
        let mut next = 0;
        while next < element.count {
            let mut runs = Vec::with_capacity(together);
            let mut failed = None;
            while runs.len() < together && next < element.count && failed.is_none() {
                let end = element.count.min(next + RUN);
                runs.push((next..end, *self));
                failed = self.pass(element, next..end).err();
                next = end;
            }
            // What a run cannot be passed over for is told by reading it, unless something before is wrong too.
            let results: Vec<_> = runs.into_par_iter().map(|(range, body)| read(range, body)).collect();
            results.into_iter().try_for_each(|result| result.map(&mut join))?;
            failed.map_or(Ok(()), Err)?;
            at(self.rest.len());
        }
        Ok(())
    }

    /// Passes over an element.
    pub fn skip(&mut self, element: &Element) -> Result<(), SceneError> {
        if element.properties.is_empty() {
            return Ok(());
        }
        self.pass(element, 0..element.count)
    }

    /// Passes over some of an element.
    fn pass(&mut self, element: &Element, range: std::ops::Range<u64>) -> Result<(), SceneError> {
        let scalar = |property: &super::header::Property| match property.kind {
            Kind::Scalar(scalar) if self.format != Format::Ascii => Some(scalar.size()),
            _ => None,
        };
        // All are of one size, unless there are lists.
        if let Some(size) = element.properties.iter().map(scalar).sum::<Option<usize>>()
            && let Some(rest) = self.rest.get(size.saturating_mul((range.end - range.start) as usize)..)
        {
            self.rest = rest;
            return Ok(());
        }
        for index in range {
            let mut values = element.properties.iter().map(|property| property.kind);
            values.try_for_each(|kind| self.skip_value(kind)).map_err(|fault| element.fault(index, self, fault))?;
        }
        Ok(())
    }

    /// Passes over a number or a list.
    pub fn skip_value(&mut self, kind: Kind) -> Result<(), Fault> {
        let (items, item) = match kind {
            Kind::Scalar(scalar) => (1, scalar),
            Kind::List { count, item } => (self.count(count)?, item),
        };
        if self.format == Format::Ascii {
            return (0..items).try_for_each(|_| self.word().map(|_| ()));
        }
        let size = items.checked_mul(item.size()).filter(|&size| size <= self.rest.len()).ok_or_else(Fault::ended)?;
        self.rest = &self.rest[size..];
        Ok(())
    }

    /// Reads a list of whole numbers.
    pub fn list(&mut self, count: Scalar, item: Scalar, items: &mut Vec<i64>) -> Result<(), Fault> {
        items.clear();
        for _ in 0..self.count(count)? {
            let value = self.scalar(item)?;
            if value.fract() != 0.0 {
                return Err(Fault::new(format!("`{value}` is no vertex"), "give whole numbers"));
            }
            items.push(value as i64);
        }
        Ok(())
    }

    /// The number of a list's items, which the rest is long enough for.
    fn count(&mut self, scalar: Scalar) -> Result<usize, Fault> {
        let count = self.scalar(scalar)?;
        if count < 0.0 || count.fract() != 0.0 {
            return Err(Fault::new(format!("it has a list of {count} items"), "give a whole number of items"));
        }
        if count > self.rest.len() as f64 {
            return Err(Fault::ended());
        }
        Ok(count as usize)
    }

    /// Reads a number; it need not be finite.
    #[inline]
    pub fn scalar(&mut self, scalar: Scalar) -> Result<f64, Fault> {
        match (self.format, scalar) {
            (Format::Ascii, _) => self.number(),
            (_, Scalar::I8) => self.bytes(i8::from_le_bytes, i8::from_be_bytes).map(f64::from),
            (_, Scalar::U8) => self.bytes(u8::from_le_bytes, u8::from_be_bytes).map(f64::from),
            (_, Scalar::I16) => self.bytes(i16::from_le_bytes, i16::from_be_bytes).map(f64::from),
            (_, Scalar::U16) => self.bytes(u16::from_le_bytes, u16::from_be_bytes).map(f64::from),
            (_, Scalar::I32) => self.bytes(i32::from_le_bytes, i32::from_be_bytes).map(f64::from),
            (_, Scalar::U32) => self.bytes(u32::from_le_bytes, u32::from_be_bytes).map(f64::from),
            (_, Scalar::F32) => self.bytes(f32::from_le_bytes, f32::from_be_bytes).map(f64::from),
            (_, Scalar::F64) => self.bytes(f64::from_le_bytes, f64::from_be_bytes),
        }
    }

    #[inline]
    fn bytes<const N: usize, T>(&mut self, little: fn([u8; N]) -> T, big: fn([u8; N]) -> T) -> Result<T, Fault> {
        let (bytes, rest) = self.rest.split_first_chunk::<N>().ok_or_else(Fault::ended)?;
        self.rest = rest;
        Ok(if self.format == Format::BigEndian { big(*bytes) } else { little(*bytes) })
    }

    fn number(&mut self) -> Result<f64, Fault> {
        let word = self.word()?;
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        number.ok_or_else(|| {
            let short = &word[..word.len().min(24)];
            Fault::new(format!("`{}` is no number", String::from_utf8_lossy(short)), "give a number")
        })
    }

    /// What lies between white space.
    fn word(&mut self) -> Result<&'a [u8], Fault> {
        let rest = self.rest.trim_ascii_start();
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if end == 0 {
            return Err(Fault::ended());
        }
        self.rest = &rest[end..];
        Ok(&rest[..end])
    }
}
