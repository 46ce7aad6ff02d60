//! Names that glTF does not know, which are told: one misspelt is as good as left out.

use std::borrow::Cow;
use std::fmt;

use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};

const TEXTURE: &[&str] = &["index", "texCoord"];

/// The objects of a file, by the name that they or the list of them stand under, and the names that may stand in them besides
/// `extensions` and `extras`, as the specification of glTF 2.0 and those of the extensions have them. What stands under another name, such
/// as animations, is not looked into.
const OBJECTS: &[(&str, &[&str])] = &[
    (
        "",
        &[
            "accessors",
            "animations",
            "asset",
            "buffers",
            "bufferViews",
            "cameras",
            "extensionsRequired",
            "extensionsUsed",
            "images",
            "materials",
            "meshes",
            "nodes",
            "samplers",
            "scene",
            "scenes",
            "skins",
            "textures",
        ],
    ),
    ("asset", &["copyright", "generator", "minVersion", "version"]),
    (
        "accessors",
        &["bufferView", "byteOffset", "componentType", "count", "max", "min", "name", "normalized", "sparse", "type"],
    ),
    ("sparse", &["count", "indices", "values"]),
    ("indices", &["bufferView", "byteOffset", "componentType"]),
    ("values", &["bufferView", "byteOffset"]),
    ("buffers", &["byteLength", "name", "uri"]),
    ("bufferViews", &["buffer", "byteLength", "byteOffset", "byteStride", "name", "target"]),
    ("cameras", &["name", "orthographic", "perspective", "type"]),
    ("orthographic", &["xmag", "ymag", "zfar", "znear"]),
    ("perspective", &["aspectRatio", "yfov", "zfar", "znear"]),
    ("images", &["bufferView", "mimeType", "name", "uri"]),
    (
        "materials",
        &[
            "alphaCutoff",
            "alphaMode",
            "doubleSided",
            "emissiveFactor",
            "emissiveTexture",
            "name",
            "normalTexture",
            "occlusionTexture",
            "pbrMetallicRoughness",
        ],
    ),
    (
        "pbrMetallicRoughness",
        &["baseColorFactor", "baseColorTexture", "metallicFactor", "metallicRoughnessTexture", "roughnessFactor"],
    ),
    ("baseColorTexture", TEXTURE),
    ("metallicRoughnessTexture", TEXTURE),
    ("emissiveTexture", TEXTURE),
    ("clearcoatTexture", TEXTURE),
    ("diffuseTexture", TEXTURE),
    ("transmissionTexture", TEXTURE),
    ("normalTexture", &["index", "scale", "texCoord"]),
    ("occlusionTexture", &["index", "strength", "texCoord"]),
    ("meshes", &["name", "primitives", "weights"]),
    ("primitives", &["attributes", "indices", "material", "mode", "targets"]),
    ("nodes", &["camera", "children", "matrix", "mesh", "name", "rotation", "scale", "skin", "translation", "weights"]),
    ("samplers", &["magFilter", "minFilter", "name", "wrapS", "wrapT"]),
    ("scenes", &["name", "nodes"]),
    ("skins", &["inverseBindMatrices", "joints", "name", "skeleton"]),
    ("textures", &["name", "sampler", "source"]),
    ("KHR_lights_punctual", &["light", "lights"]),
    ("lights", &["color", "intensity", "name", "range", "spot", "type"]),
    ("spot", &["innerConeAngle", "outerConeAngle"]),
    (
        "KHR_materials_clearcoat",
        &[
            "clearcoatFactor",
            "clearcoatNormalTexture",
            "clearcoatRoughnessFactor",
            "clearcoatRoughnessTexture",
            "clearcoatTexture",
        ],
    ),
    ("KHR_materials_emissive_strength", &["emissiveStrength"]),
    ("KHR_materials_ior", &["ior"]),
    (
        "KHR_materials_pbrSpecularGlossiness",
        &["diffuseFactor", "diffuseTexture", "glossinessFactor", "specularFactor", "specularGlossinessTexture"],
    ),
    (
        "KHR_materials_sheen",
        &["sheenColorFactor", "sheenColorTexture", "sheenRoughnessFactor", "sheenRoughnessTexture"],
    ),
    ("KHR_materials_specular", &["specularColorFactor", "specularColorTexture", "specularFactor", "specularTexture"]),
    ("KHR_materials_transmission", &["transmissionFactor", "transmissionTexture"]),
    ("KHR_materials_volume", &["attenuationColor", "attenuationDistance", "thicknessFactor", "thicknessTexture"]),
    ("KHR_node_visibility", &["visible"]),
    ("KHR_texture_transform", &["offset", "rotation", "scale", "texCoord"]),
];

/// A name that its object cannot have.
pub struct Unknown<'t> {
    /// As it is spelt.
    pub key: Cow<'t, str>,
    /// What the object or its list stands under; nothing of the file as a whole.
    pub of: &'static str,
    /// What may stand there.
    pub valid: &'static [&'static str],
}

/// The names in a file's JSON that are not known, but for those that lie in `extras` and in extensions that are not known. Of a text that
/// is no JSON there are those before its fault.
pub fn unknown(text: &str) -> Vec<Unknown<'_>> {
    let mut found = Vec::new();
    let mut json = serde_json::Deserializer::from_str(text);
    // What is wrong with the JSON is told where it is read.
    let _ = Within { object: Object::called(""), found: &mut found }.deserialize(&mut json);
    found
}

/// What stands under a name, by itself or in a list.
#[derive(Clone, Copy)]
enum Object {
    /// One of [`OBJECTS`].
    Known(&'static str, &'static [&'static str]),
    /// Extensions by their names.
    Extensions,
    /// Anything.
    Other,
}

impl Object {
    fn called(name: &str) -> Self {
        let known = OBJECTS.iter().find(|(known, _)| *known == name);
        known.map_or(Self::Other, |&(name, valid)| Self::Known(name, valid))
    }

    /// What stands under a key of it, or `None` where there can be no such key.
    fn part(self, key: &str) -> Option<Self> {
        match self {
            Self::Known(_, valid) if valid.contains(&key) => Some(Self::called(key)),
            Self::Known(..) if key == "extensions" => Some(Self::Extensions),
            Self::Known(..) if key == "extras" => Some(Self::Other),
            Self::Known(..) => None,
            Self::Extensions => Some(Self::called(key)),
            Self::Other => Some(Self::Other),
        }
    }
}

/// Looks for names within a part of the file.
struct Within<'f, 't> {
    object: Object,
    found: &'f mut Vec<Unknown<'t>>,
}

impl<'t> DeserializeSeed<'t> for Within<'_, 't> {
    type Value = ();

    fn deserialize<D: Deserializer<'t>>(self, deserializer: D) -> Result<(), D::Error> {
        match self.object {
            Object::Other => IgnoredAny::deserialize(deserializer).map(|_| ()),
            _ => deserializer.deserialize_any(self),
        }
    }
}

/// A name, borrowed from the text where it has no escapes.
#[derive(Deserialize)]
struct Key<'t>(#[serde(borrow)] Cow<'t, str>);

impl<'t> Visitor<'t> for Within<'_, 't> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_map<A: MapAccess<'t>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(Key(key)) = map.next_key()? {
            let part = self.object.part(&key);
            if let (None, Object::Known(of, valid)) = (part, self.object) {
                self.found.push(Unknown { key, of, valid });
            }
            map.next_value_seed(Within { object: part.unwrap_or(Object::Other), found: &mut *self.found })?;
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'t>>(self, mut list: A) -> Result<(), A::Error> {
        while list.next_element_seed(Within { object: self.object, found: &mut *self.found })?.is_some() {}
        Ok(())
    }

    fn visit_bool<E>(self, _: bool) -> Result<(), E> {
        Ok(())
    }

    fn visit_i64<E>(self, _: i64) -> Result<(), E> {
        Ok(())
    }

    fn visit_u64<E>(self, _: u64) -> Result<(), E> {
        Ok(())
    }

    fn visit_f64<E>(self, _: f64) -> Result<(), E> {
        Ok(())
    }

    fn visit_str<E>(self, _: &str) -> Result<(), E> {
        Ok(())
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }
}
