//! The protocol of `tev` (as its author's `Ipc.cpp` reads it): packets of a length that counts itself, an operation and its values, all
//! little endian, over TCP. Strings end with a zero byte.

use super::Image;
use std::io::{self, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// Where `tev` listens unless it is told otherwise.
pub const ADDRESS: &str = "127.0.0.1:14158";
/// How long it may take to answer, and then to take a packet.
const PATIENCE: Duration = Duration::from_secs(5);
/// Bytes of pixels in a packet, at most, unless a row has more.
const PACKET: usize = 1 << 20;

/// Operations, as numbered there.
const CREATE_IMAGE: u8 = 4;
const UPDATE_IMAGE: u8 = 6;

/// A `tev` that listens.
pub struct Tev {
    stream: TcpStream,
    /// The names of the images that it has by now.
    created: Vec<String>,
}

impl Tev {
    /// Connects to it.
    pub fn connect(address: &str) -> io::Result<Self> {
        let mut refused = io::Error::new(io::ErrorKind::InvalidInput, "no such address; HOST:PORT is needed");
        for place in address.to_socket_addrs()? {
            match TcpStream::connect_timeout(&place, PATIENCE) {
                Ok(stream) => {
                    stream.set_write_timeout(Some(PATIENCE))?;
                    return Ok(Self { stream, created: Vec::new() });
                }
                Err(why) => refused = why,
            }
        }
        Err(refused)
    }

    /// Shows an image under a name: the sum of its layers first, as colours are called, then each of them.
    pub fn show(&mut self, name: &str, image: &dyn Image) -> io::Result<()> {
        let layers = image.layers();
        let channels = channels(&layers);
        if !self.created.iter().any(|there| there == name) {
            self.stream.write_all(&create(name, image.size(), &channels))?;
            self.created.push(name.to_owned());
        }
        let (width, height) = image.size();
        let row = width as usize * channels.len() * size_of::<f32>();
        let rows = (PACKET / row.max(1)).clamp(1, height.max(1) as usize) as u32;
        for first in (0..height).step_by(rows as usize) {
            let rows = rows.min(height - first);
            let pixels = (first * width) as usize..((first + rows) * width) as usize;
            let mut values = Vec::with_capacity(pixels.len() * channels.len());
            for pixel in pixels {
                values.extend(image.sum(layers.len(), pixel).map(|x| x as f32));
                (0..layers.len()).for_each(|layer| values.extend(image.pixel(layer, pixel).map(|x| x as f32)));
            }
            self.stream.write_all(&update(name, &channels, (first, width, rows), &values))?;
        }
        Ok(())
    }
}

/// The names of channels: those of the sum, then those of the layers.
fn channels(layers: &[String]) -> Vec<String> {
    let of = |layer: &str| ["R", "G", "B"].map(|colour| format!("{layer}{colour}"));
    let layers = layers.iter().flat_map(|layer| of(&format!("{layer}.")));
    of("").into_iter().chain(layers).collect()
}

/// What makes an image, black, in place of one of the same name; it becomes the one that is looked at.
fn create(name: &str, (width, height): (u32, u32), channels: &[String]) -> Vec<u8> {
    let mut packet = Packet::new(CREATE_IMAGE, true, name);
    packet.numbers([width, height, channels.len() as u32]);
    channels.iter().for_each(|channel| packet.text(channel));
    packet.end()
}

/// What changes whole rows of an image: the first, how wide and how many they are. Values are `[pixel][channel]`.
fn update(name: &str, channels: &[String], (first, width, rows): (u32, u32, u32), values: &[f32]) -> Vec<u8> {
    let mut packet = Packet::new(UPDATE_IMAGE, false, name);
    packet.numbers([channels.len() as u32]);
    channels.iter().for_each(|channel| packet.text(channel));
    packet.numbers([0, first, width, rows]);
    let (offsets, stride) = (0..channels.len() as i64, channels.len() as i64);
    offsets.for_each(|offset| packet.bytes(&offset.to_le_bytes()));
    channels.iter().for_each(|_| packet.bytes(&stride.to_le_bytes()));
    values.iter().for_each(|value| packet.bytes(&value.to_le_bytes()));
    packet.end()
}

/// A packet being written.
struct Packet(Vec<u8>);

impl Packet {
    /// One of an operation on the image of this name, which is to be looked at or not.
    fn new(operation: u8, focus: bool, name: &str) -> Self {
        let mut packet = Self(vec![0, 0, 0, 0, operation, u8::from(focus)]);
        packet.text(name);
        packet
    }

    fn bytes(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    /// A text, of which a zero byte would be the end.
    fn text(&mut self, text: &str) {
        self.0.extend(text.bytes().filter(|&byte| byte != 0));
        self.0.push(0);
    }

    fn numbers<const N: usize>(&mut self, numbers: [u32; N]) {
        numbers.iter().for_each(|number| self.bytes(&number.to_le_bytes()));
    }

    /// The packet with its length in front.
    fn end(mut self) -> Vec<u8> {
        let length = (self.0.len() as u32).to_le_bytes();
        self.0[..4].copy_from_slice(&length);
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What tevclient 1.0.4, by tev's author, sends: `create_image("a ü", 2, 3, ["R", "order00.G"])`, and
    /// `update_image("a ü", [[[1, 2], [-3, 0.5]], [[inf, 0], [1e-9, 7]]], ["R", "order00.G"], 0, 1)`.
    const THEIRS: &[u8] = include_bytes!("../../../tests/fixtures/tevclient.bin");

    #[test]
    fn packets_are_those_of_the_client_by_the_author_of_tev() {
        let channels = ["R".to_owned(), "order00.G".to_owned()];
        let values = [1.0, 2.0, -3.0, 0.5, f32::INFINITY, 0.0, 1e-9, 7.0];
        let ours = [create("a ü", (2, 3), &channels), update("a ü", &channels, (1, 2, 2), &values)];
        assert_eq!(ours.concat(), THEIRS);
    }

    #[test]
    fn a_zero_byte_does_not_end_a_name() {
        assert_eq!(Packet::new(CREATE_IMAGE, false, "a\0b").0[6..], *b"ab\0");
    }
}
