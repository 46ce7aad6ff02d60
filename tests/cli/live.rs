//! Images while they are rendered, as a small server of tev's protocol sees them.

use super::*;
use std::collections::BTreeMap;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};

/// A channel's pixels, row by row; `None` until they are sent.
type Channel = Vec<Option<f32>>;
/// An image's size, and its channels by name.
type Image = ((usize, usize), BTreeMap<String, Channel>);

/// What was sent: images by name, and how often pixels came.
#[derive(Default)]
struct Window {
    images: BTreeMap<String, Image>,
    updates: usize,
}

/// A packet being read.
struct Packet<'a>(&'a [u8]);

impl Packet<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (taken, rest) = self.0.split_first_chunk().expect("a packet is as long as it says");
        self.0 = rest;
        *taken
    }

    fn int(&mut self) -> usize {
        i32::from_le_bytes(self.take()).try_into().unwrap()
    }

    fn long(&mut self) -> usize {
        i64::from_le_bytes(self.take()).try_into().unwrap()
    }

    fn text(&mut self) -> String {
        let end = self.0.iter().position(|&byte| byte == 0).unwrap();
        let text = String::from_utf8(self.0[..end].to_vec()).unwrap();
        self.0 = &self.0[end + 1..];
        text
    }
}

impl Window {
    /// Reads packets until the sender is done.
    fn listen(mut stream: impl Read) -> Self {
        let mut window = Self::default();
        loop {
            let mut length = [0; 4];
            match stream.read_exact(&mut length) {
                Err(end) if end.kind() == ErrorKind::UnexpectedEof => return window,
                read => read.unwrap(),
            }
            let mut packet = vec![0; u32::from_le_bytes(length) as usize - 4];
            stream.read_exact(&mut packet).unwrap();
            window.take(Packet(&packet));
        }
    }

    fn take(&mut self, mut packet: Packet) {
        let [operation, _focus] = packet.take();
        let name = packet.text();
        match operation {
            4 => {
                let (width, height, count) = (packet.int(), packet.int(), packet.int());
                let channels = (0..count).map(|_| (packet.text(), vec![None; width * height])).collect();
                self.images.insert(name, ((width, height), channels));
            }
            6 => {
                let count = packet.int();
                let names: Vec<_> = (0..count).map(|_| packet.text()).collect();
                let [x, y, width, height] = [(); 4].map(|()| packet.int());
                let offsets: Vec<_> = (0..count).map(|_| packet.long()).collect();
                let strides: Vec<_> = (0..count).map(|_| packet.long()).collect();
                let data: Vec<f32> = packet.0.as_chunks().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
                packet.0 = &[];
                let (size, channels) = self.images.get_mut(&name).expect("an image is made before it changes");
                for ((name, offset), stride) in names.iter().zip(offsets).zip(strides) {
                    let channel = channels.get_mut(name).expect("the image has the channel");
                    for pixel in 0..width * height {
                        channel[(y + pixel / width) * size.0 + x + pixel % width] = Some(data[offset + pixel * stride]);
                    }
                }
                self.updates += 1;
            }
            other => panic!("operation {other}"),
        }
        assert!(packet.0.is_empty(), "{} bytes too many", packet.0.len());
    }
}

/// Listens while the program runs, which must succeed; gives what was sent, and what was said.
fn watched(folder: &Path, arguments: &[&str]) -> (Window, String) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let live = format!("--live={}", listener.local_addr().unwrap());
    let server = std::thread::spawn(move || Window::listen(listener.accept().unwrap().0));
    let said = succeed(folder, &[arguments, &[&live]].concat());
    (server.join().unwrap(), said)
}

/// The server reads what `tevclient` of `tev`'s author sends as it was meant.
#[test]
fn the_server_knows_the_protocol() {
    let sent = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/tevclient.bin")).unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    client.write_all(&sent).unwrap();
    drop(client);
    let window = Window::listen(listener.accept().unwrap().0);
    let (size, channels) = &window.images["a ü"];
    assert_eq!(*size, (2, 3));
    let sent = |values: [f32; 4]| [None, None].into_iter().chain(values.map(Some)).collect::<Channel>();
    assert_eq!(channels["R"], sent([1.0, -3.0, f32::INFINITY, 1e-9]));
    assert_eq!(channels["order00.G"], sent([2.0, 0.5, 0.0, 7.0]));
}

#[test]
fn what_is_sent_last_is_the_image_that_is_written() {
    let folder = folder_with(&[]);
    let render = ["render", "cornell_box", "-i", "bdpt", "--size", "48x40", "--spp", "18", "--replicates", "9"];
    let crop = ["--max-order", "3", "--tail", "--crop", "7,5,20,30", "-o", "a.exr"];
    let (window, _) = watched(folder.path(), &[&render[..], &crop].concat());
    let (size, channels) = &window.images["bdpt in cornell_box"];
    assert_eq!(*size, (20, 30));
    assert!(window.updates >= 2, "{} updates", window.updates);
    let written = read_layers(&folder.path().join("a.exr")).unwrap();
    let names = ["", "order00.", "order01.", "order02.", "order03.", "tail."];
    assert_eq!(channels.len(), 3 * names.len());
    for name in names {
        let layer = written.layer(name.trim_end_matches('.')).unwrap();
        for (c, colour) in ["R", "G", "B"].iter().enumerate() {
            let sent: Vec<f32> = channels[&format!("{name}{colour}")].iter().map(|value| value.unwrap()).collect();
            let file: Vec<f32> = layer.pixels.iter().map(|pixel| pixel[c]).collect();
            assert_eq!(sent, file, "{name}{colour}");
        }
    }
}

#[test]
fn a_run_shows_every_method_in_every_scene() {
    let folder = folder_with(&[("tiny.toml", EXPERIMENT)]);
    let (window, _) = watched(folder.path(), &["run", "tiny.toml"]);
    let methods: Vec<&str> = window.images.keys().map(String::as_str).collect();
    assert_eq!(methods, ["bdpt in furnace", "path in furnace"]);
    assert!(window.images.values().flat_map(|(_, channels)| channels.values().flatten()).all(Option::is_some));
}

#[test]
fn a_window_that_is_closed_does_not_end_the_work() {
    let folder = folder_with(&[]);
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let live = format!("--live={}", listener.local_addr().unwrap());
    let server = std::thread::spawn(move || drop(listener.accept().unwrap()));
    let render =
        ["render", "cornell_box", "--size", "64x64", "--spp", "64", "--replicates", "32", "-o", "a.exr", &live];
    let output = neumann(folder.path(), &render);
    server.join().unwrap();
    assert!(output.status.success());
    let said = text(&output.stderr);
    assert_eq!(said.matches("the image is no longer shown").count(), 1, "{said}");
    assert!(read_layers(&folder.path().join("a.exr")).is_ok());
}

#[test]
fn nothing_is_rendered_for_a_window_that_is_not_there() {
    let folder = folder_with(&[]);
    let address = {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        listener.local_addr().unwrap().to_string()
    };
    let render = ["render", "cornell_box", "-o", "a.exr"];
    let live = format!("--live={address}");
    refused(folder.path(), &[&render[..], &[&live]].concat(), &[&live, "no tev answers there", "--hostname="]);
    refused(folder.path(), &[&render[..], &["--live=nowhere"]].concat(), &["--live=nowhere"]);
    if TcpStream::connect("127.0.0.1:14158").is_ok() {
        println!("skipped in part: something listens at tev's address");
    } else {
        refused(folder.path(), &[&render[..], &["--live"]].concat(), &["no tev answers", "no terminal"]);
    }
}
