//! Numbers where they lie: nothing is decoded but what is asked for.

use super::buffers::Asset;
use super::document::Item;
use super::schema::{self, Kind};
use crate::error::SceneError;

/// What a number is stored as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number that these bytes begin with; whole ones that are `normalized` are shares of the greatest.
    #[inline]
    fn read(self, bytes: &[u8], normalized: bool) -> f64 {
        let two = || [bytes[0], bytes[1]];
        let four = || [bytes[0], bytes[1], bytes[2], bytes[3]];
        let (value, greatest) = match self {
            Self::I8 => (f64::from(bytes[0] as i8), 127.0),
            Self::U8 => (f64::from(bytes[0]), 255.0),
            Self::I16 => (f64::from(i16::from_le_bytes(two())), 32767.0),
            Self::U16 => (f64::from(u16::from_le_bytes(two())), 65535.0),
            Self::U32 => (f64::from(u32::from_le_bytes(four())), f64::from(u32::MAX)),
            Self::F32 => return f64::from(f32::from_le_bytes(four())),
        };
        if normalized { (value / greatest).max(-1.0) } else { value }
    }
}

/// Elements with a distance, whose bytes have been found to be there.
#[derive(Clone, Copy)]
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    component: Component,
    normalized: bool,
    components: usize,
}

impl Elements<'_> {
    #[inline]
    fn get<const N: usize>(&self, index: usize) -> [f64; N] {
        let bytes = &self.bytes[index * self.stride..];
        let size = self.component.size();
        std::array::from_fn(|c| {
            if c < self.components { self.component.read(&bytes[c * size..], self.normalized) } else { 0.0 }
        })
    }
}

/// A list of numbers, pairs, points.
pub struct Accessor<'a, 't> {
    /// Its object.
    pub item: Item<'t>,
    /// How many elements it has.
    pub count: usize,
    /// How many numbers an element has.
    pub components: usize,
    component: Component,
    /// `None` where all is 0.
    elements: Option<Elements<'a>>,
    /// Indices, ascending, and values in place of those at the indices.
    sparse: Option<(Vec<u32>, Elements<'a>)>,
}

impl<'a, 't> Accessor<'a, 't> {
    /// The accessor of this number, all of whose bytes are there; `by` is who names it.
    pub fn open(asset: &'a Asset<'t>, index: usize, by: &Item<'t>) -> Result<Self, SceneError> {
        let document = &asset.document;
        let item = document.item(Kind::Accessor, index, by)?;
        let accessor: schema::Accessor = document.parse(&item)?;
        let wrong = |message: String, mend: &str| Err(document.error(&item, message, mend));
        let component = |code: u32| {
            Component::of(code).ok_or_else(|| {
                let mend = "give one of 5120, 5121, 5122, 5123, 5125, 5126";
                document.error(&item, format!("has the component type {code}"), mend)
            })
        };
        let components = match accessor.shape.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            other => {
                let message = format!("has the type `{}`", crate::suggest::shown(other));
                return wrong(message, "give SCALAR, VEC2, VEC3, VEC4 or MAT4");
            }
        };
        let kind = component(accessor.component_type)?;
        if accessor.count > u32::MAX as usize {
            return wrong(format!("has {} elements", accessor.count), "give fewer than 2³²");
        }
        let element = Elements { bytes: &[], stride: 0, component: kind, normalized: accessor.normalized, components };
        let place = |view: usize, offset: usize, count: usize, element: Elements<'a>| {
            let view = asset.view(view, &item)?;
            let size = element.components * element.component.size();
            let stride = view.stride.unwrap_or(size);
            if stride < size {
                let message = format!("has elements of {size} bytes, {stride} bytes apart");
                return Err(document.error(&item, message, "give a `byteStride` that is no smaller"));
            }
            let length = count.saturating_sub(1).checked_mul(stride).and_then(|length| length.checked_add(size));
            let end = length.and_then(|length| length.checked_add(offset)).filter(|&end| end <= view.bytes.len());
            if count > 0 && end.is_none() {
                let has = view.bytes.len();
                let message =
                    format!("needs {count} elements, {stride} bytes apart from byte {offset}, and its view has {has}");
                return Err(document.error(&item, message, "keep it within its buffer view"));
            }
            Ok(Elements { bytes: view.bytes.get(offset..).unwrap_or(&[]), stride, ..element })
        };
        let elements = match accessor.buffer_view {
            Some(view) => Some(place(view, accessor.byte_offset, accessor.count, element)?),
            None => None,
        };
        let sparse = match &accessor.sparse {
            None => None,
            Some(sparse) => {
                document.spend(&item, sparse.count.saturating_mul(4))?;
                let indices = Elements {
                    component: component(sparse.indices.component_type)?,
                    normalized: false,
                    components: 1,
                    ..element
                };
                if !matches!(indices.component, Component::U8 | Component::U16 | Component::U32) {
                    return wrong("has sparse indices that are no whole numbers".into(), "give 5121, 5123 or 5125");
                }
                let at = place(sparse.indices.buffer_view, sparse.indices.byte_offset, sparse.count, indices)?;
                let values = place(sparse.values.buffer_view, sparse.values.byte_offset, sparse.count, element)?;
                let indices: Vec<u32> = (0..sparse.count).map(|i| at.get::<1>(i)[0] as u32).collect();
                let grow = indices.windows(2).all(|pair| pair[0] < pair[1]);
                if !grow || indices.last().is_some_and(|&last| last as usize >= accessor.count) {
                    let message = format!("has sparse indices that do not grow within its {} elements", accessor.count);
                    return wrong(message, "give each once, in order");
                }
                Some((indices, values))
            }
        };
        Ok(Self { item, count: accessor.count, components, component: kind, elements, sparse })
    }

    /// The element at a place below [`count`](Self::count); numbers that it has not are 0.
    #[inline]
    pub fn get<const N: usize>(&self, index: usize) -> [f64; N] {
        if let Some((indices, values)) = &self.sparse
            && let Ok(place) = indices.binary_search(&(index as u32))
        {
            return values.get(place);
        }
        self.elements.as_ref().map_or([0.0; N], |elements| elements.get(index))
    }

    /// Whether its numbers may be indices.
    pub fn is_whole(&self) -> bool {
        self.components == 1 && matches!(self.component, Component::U8 | Component::U16 | Component::U32)
    }

    /// Whether it has any bytes.
    pub fn has_bytes(&self) -> bool {
        self.elements.is_some() || self.sparse.is_some()
    }

    /// The index that would begin another strip.
    pub fn restart(&self) -> u32 {
        match self.component {
            Component::U8 => u32::from(u8::MAX),
            Component::U16 => u32::from(u16::MAX),
            _ => u32::MAX,
        }
    }
}
