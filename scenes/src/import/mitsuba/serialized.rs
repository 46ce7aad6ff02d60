//! Mitsuba's `serialized` meshes: a header, then a zlib stream for each mesh, and at the end where each begins.

use std::io::Read;
use std::path::Path;

use flate2::bufread::ZlibDecoder;
use glam::DVec3;
use sampling::{Vec2, Vec3};

use crate::builder::MeshData;
use crate::error::SceneError;
use crate::file::Unpacked;

const MAGIC: u16 = 0x041c;
const HAS_NORMALS: u32 = 0x1;
const HAS_UVS: u32 = 0x2;
const HAS_COLOURS: u32 = 0x8;
const FACE_NORMALS: u32 = 0x10;
const DOUBLE: u32 = 0x2000;
/// The most vertices or triangles of a mesh.
const MOST: u64 = 1 << 28;
/// The most bytes of a mesh's name.
const LONGEST_NAME: usize = 65_536;

/// One mesh of a file.
pub struct Serialized {
    /// The mesh.
    pub mesh: MeshData,
    /// Whether it says of itself that it has no normals but those of its faces.
    pub face_normals: bool,
}

/// The mesh of this number, counted from 0.
pub fn read(path: &Path, bytes: &[u8], index: usize) -> Result<Serialized, SceneError> {
    decode(bytes, index).map_err(|message| SceneError::invalid(message, "give a file that Mitsuba wrote").in_file(path))
}

fn decode(bytes: &[u8], index: usize) -> Result<Serialized, String> {
    let short = |at: usize| bytes.get(at..at + 2).map(|b| u16::from_le_bytes([b[0], b[1]]));
    let version = short(2).ok_or("the file is too short")?;
    if short(0) != Some(MAGIC) || !(version == 3 || version == 4) {
        return Err("it is no `serialized` file of version 3 or 4".to_string());
    }
    let start = if index == 0 { 0 } else { offset(bytes, index, version)? };
    let stream = bytes.get(start.saturating_add(4)..).ok_or("a mesh begins beyond the file's end")?;
    let mut stream = Stream(Unpacked::new(ZlibDecoder::new(stream), stream.len() as u64));
    let flags = stream.u32()?;
    if version == 4 {
        stream.skip_name()?;
    }
    let (vertices, triangles) = (stream.u64()?, stream.u64()?);
    if vertices > MOST || triangles > MOST {
        return Err(format!("a mesh has {vertices} vertices and {triangles} triangles, more than can be"));
    }
    let (vertices, triangles) = (vertices as usize, triangles as usize);
    let double = flags & DOUBLE != 0;
    let positions = stream.floats(3 * vertices, double)?;
    let normals = if flags & HAS_NORMALS != 0 { stream.floats(3 * vertices, double)? } else { Vec::new() };
    let uvs = if flags & HAS_UVS != 0 { stream.floats(2 * vertices, double)? } else { Vec::new() };
    let colours = if flags & HAS_COLOURS != 0 { stream.floats(3 * vertices, double)? } else { Vec::new() };
    drop(colours);
    let indices = stream.take(12 * triangles)?;
    let indices: Vec<u32> = indices.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    if indices.iter().any(|&i| i as usize >= vertices) {
        return Err("a triangle names a vertex that is not there".to_string());
    }
    let all = positions.iter().chain(&normals).chain(&uvs);
    if all.into_iter().any(|x| !x.is_finite() || x.abs() > 1e15) {
        return Err("a mesh holds a number that is not finite".to_string());
    }
    let mesh = MeshData {
        positions: positions.chunks_exact(3).map(DVec3::from_slice).collect(),
        triangles: indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        normals: normals
            .chunks_exact(3)
            .map(|n| DVec3::from_slice(n).normalize_or_zero().as_vec3())
            .collect::<Vec<Vec3>>(),
        uvs: uvs.chunks_exact(2).map(|uv| Vec2::new(uv[0] as f32, uv[1] as f32)).collect(),
        ..MeshData::default()
    };
    Ok(Serialized { mesh, face_normals: flags & FACE_NORMALS != 0 })
}

/// Where a mesh begins, by the list at the file's end.
fn offset(bytes: &[u8], index: usize, version: u16) -> Result<usize, String> {
    let end = bytes.len().checked_sub(4).ok_or("the file is too short")?;
    let count = u32::from_le_bytes(bytes[end..].try_into().map_err(|_| "the file is too short")?) as usize;
    if index >= count {
        return Err(format!("it has no mesh {index}: it holds {count}, counted from 0"));
    }
    let width = if version == 4 { 8 } else { 4 };
    let at = end.checked_sub(width * (count - index)).ok_or("its list of meshes is longer than it")?;
    let mut number = [0; 8];
    number[..width].copy_from_slice(&bytes[at..at + width]);
    usize::try_from(u64::from_le_bytes(number)).map_err(|_| "a mesh begins beyond the file's end".to_string())
}

struct Stream<'b>(Unpacked<ZlibDecoder<&'b [u8]>>);

impl Stream<'_> {
    /// So many bytes; memory is taken as they come, whatever a header promises.
    fn take(&mut self, count: usize) -> Result<Vec<u8>, String> {
        let mut bytes = Vec::new();
        let read = self.0.by_ref().take(count as u64).read_to_end(&mut bytes);
        read.map_err(|error| format!("it cannot be decompressed: {error}"))?;
        if bytes.len() < count { Err("a mesh ends early".to_string()) } else { Ok(bytes) }
    }

    /// Passes over a name, which ends with a zero.
    fn skip_name(&mut self) -> Result<(), String> {
        for _ in 0..LONGEST_NAME {
            let mut byte = [0];
            self.0.read_exact(&mut byte).map_err(|_| "a mesh ends early".to_string())?;
            if byte[0] == 0 {
                return Ok(());
            }
        }
        Err("the name of a mesh does not end".to_string())
    }

    fn u32(&mut self) -> Result<u32, String> {
        let bytes = self.take(4)?;
        Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }

    fn u64(&mut self) -> Result<u64, String> {
        Ok(u64::from(self.u32()?) | u64::from(self.u32()?) << 32)
    }

    fn floats(&mut self, count: usize, double: bool) -> Result<Vec<f64>, String> {
        let bytes = self.take(count * if double { 8 } else { 4 })?;
        Ok(if double {
            bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap_or_default())).collect()
        } else {
            bytes.chunks_exact(4).map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap_or_default()))).collect()
        })
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use flate2::Compression;
    use flate2::write::ZlibEncoder;
    use std::io::Write;

    /// A file of two meshes: a triangle at height 0 and, with texture coordinates and in `f64`, one at height 5.
    pub fn file() -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut starts = Vec::new();
        for (flags, z) in [(0x1000u32, 0.0), (DOUBLE | HAS_UVS, 5.0)] {
            starts.push(bytes.len() as u64);
            bytes.extend([0x1c, 0x04, 0x04, 0x00]);
            let mut body = flags.to_le_bytes().to_vec();
            body.extend(b"name\0");
            body.extend([3u64.to_le_bytes(), 1u64.to_le_bytes()].concat());
            for x in [0.0, 0.0, z, 1.0, 0.0, z, 0.0, 1.0, z] {
                if flags & DOUBLE != 0 {
                    body.extend(f64::to_le_bytes(x))
                } else {
                    body.extend((x as f32).to_le_bytes())
                }
            }
            if flags & HAS_UVS != 0 {
                [0.0f64, 0.0, 1.0, 0.0, 0.0, 1.0].iter().for_each(|x| body.extend(x.to_le_bytes()));
            }
            [0u32, 1, 2].iter().for_each(|i| body.extend(i.to_le_bytes()));
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
            encoder.write_all(&body).unwrap();
            bytes.extend(encoder.finish().unwrap());
        }
        starts.iter().for_each(|start| bytes.extend(start.to_le_bytes()));
        bytes.extend(2u32.to_le_bytes());
        bytes
    }

    #[test]
    fn meshes_are_found_by_their_number() {
        let bytes = file();
        for (index, z, uvs) in [(0, 0.0, 0), (1, 5.0, 3)] {
            let mesh = decode(&bytes, index).unwrap().mesh;
            assert_eq!((mesh.positions[1], mesh.triangles.len()), (DVec3::new(1.0, 0.0, z), 1));
            assert_eq!(mesh.uvs.len(), uvs);
        }
        assert!(decode(&bytes, 2).is_err_and(|message| message.contains("no mesh 2")));
    }

    #[test]
    fn damaged_files_are_refused() {
        let bytes = file();
        for end in 0..bytes.len() {
            _ = decode(&bytes[..end], 0);
            _ = decode(&bytes[..end], 1);
        }
        for i in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[i] ^= 0x55;
            _ = decode(&damaged, 1);
        }
        assert!(decode(b"\x1c\x04\x09\x00", 0).is_err());
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(&[b'n'; 1_000_000]).unwrap();
        let endless = [&b"\x1c\x04\x04\x00"[..], &encoder.finish().unwrap()].concat();
        assert!(decode(&endless, 0).is_err_and(|message| message.contains("name of a mesh does not end")));
    }

    #[test]
    fn a_mesh_of_nothing_but_zeros_does_not_fill_the_memory() {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
        let header = [&0x1000u32.to_le_bytes()[..], b"\0", &(1u64 << 26).to_le_bytes(), &1u64.to_le_bytes()].concat();
        encoder.write_all(&header).unwrap();
        std::io::copy(&mut std::io::repeat(0).take(100 << 20), &mut encoder).unwrap();
        let bytes = [&b"\x1c\x04\x04\x00"[..], &encoder.finish().unwrap()].concat();
        assert!(decode(&bytes, 0).is_err_and(|message| message.contains("more than 200 times as large")));
    }
}
