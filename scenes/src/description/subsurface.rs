//! Materials of `type = "subsurface"` in scene files.

use super::reader::{Table, Value};
use crate::error::SceneError;
use crate::material::Material;
use crate::subsurface::Body;
use sampling::math::Spectrum;
use sampling::subsurface::Subsurface;

/// The name of the type.
pub(super) const NAME: &str = "subsurface";

/// Reads `{ type = "subsurface", albedo, mean_free_path, eta }`: the share of light that comes in which goes out again; how far
/// it goes between scatterings \[m\], which `transform` does not scale; and the index of refraction, 1.5 where it is missing.
pub(super) fn read(table: &Table, name: &str) -> Result<Material, SceneError> {
    table.allow_only(&["type", "albedo", "mean_free_path", "eta"])?;
    let albedo = colour(&table.need("albedo", "[0.8, 0.6, 0.5]")?)?;
    let mean_free_path = colour(&table.need("mean_free_path", "[0.004, 0.002, 0.001]")?)?;
    let eta = table.get("eta").map_or(Ok(1.5), |value| value.number())?;
    let subsurface =
        Subsurface::new(albedo, mean_free_path, eta as f32).map_err(|misfit| match table.get(misfit.parameter) {
            Some(value) => value.error(misfit.mend),
            None => table.error(format!("`{}` has a bad `{}`", table.name, misfit.parameter), misfit.mend),
        })?;
    Ok(Body::new(name, subsurface).into())
}

fn colour(value: &Value) -> Result<Spectrum, SceneError> {
    if value.is_table() {
        return Err(value.error("it cannot vary over a body; give a number or [r, g, b]"));
    }
    value.colour()
}

#[cfg(test)]
mod tests {
    use crate::description::{Origin, read};
    use crate::needs::Skip;
    use crate::scene::Scene;
    use sampling::math::Spectrum;
    use std::path::Path;

    /// A ball of a material of these keys, which begin at line 6.
    fn load(keys: &str) -> Result<Scene, String> {
        let text = format!(
            "[camera]\nposition = [0, 0, 3]\ntarget = [0, 0, 0]\n[materials.wax]\ntype = \"subsurface\"\n{keys}\n\
             [[shapes]]\ntype = \"sphere\"\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"wax\"\n"
        );
        let origin = Origin { scene: "test", file: "test.toml", folder: Some(Path::new(".")), attachments: &[] };
        read(&text, origin, None).and_then(|builder| builder.build(Skip::default())).map_err(|error| error.to_string())
    }

    #[test]
    fn a_body_is_read_and_keeps_its_name() {
        let scene = load("albedo = 0.5\nmean_free_path = [0.1, 0.2, 0.3]\neta = 1.3").unwrap();
        let bodies: Vec<_> = scene.bodies().collect();
        assert_eq!((bodies.len(), bodies[0].name.as_str()), (1, "wax"));
        assert_eq!(bodies[0].subsurface.albedo(), Spectrum::splat(0.5));
        assert_eq!(bodies[0].subsurface.eta(), 1.3);
        assert_eq!(load("albedo = 1\nmean_free_path = 1").unwrap().bodies().next().unwrap().subsurface.eta(), 1.5);
    }

    #[test]
    fn bad_values_are_named() {
        let cases = [
            ("mean_free_path = 1", "test.toml:4: `materials.wax` lacks `albedo`; add for example"),
            ("albedo = 1", "test.toml:4: `materials.wax` lacks `mean_free_path`; add for example"),
            (
                "albedo = 1.2\nmean_free_path = 1",
                "test.toml:6: `materials.wax.albedo` is `1.2`; keep every channel between 0",
            ),
            (
                "albedo = 1\nmean_free_path = 0",
                "test.toml:7: `materials.wax.mean_free_path` is `0`; it is a length in metres",
            ),
            (
                "albedo = 1\nmean_free_path = [1, -1, 1]",
                "test.toml:7: `materials.wax.mean_free_path` is `[1, -1, 1]`; it is a length",
            ),
            ("albedo = 1\nmean_free_path = 1\neta = 0", "test.toml:8: `materials.wax.eta` is `0`; keep it between"),
            ("albedo = 1\nmean_free_path = 1\nmfp = 1", "test.toml:8: unknown key `mfp` in `materials.wax`"),
            (
                "mean_free_path = 1\nalbedo = { ramp = { base = 0.5, slope = 0.4, axis = [0, 0, 1] } }",
                "test.toml:7: `materials.wax.albedo` is",
            ),
            ("albedo = \"red\"\nmean_free_path = 1", "test.toml:6: `materials.wax.albedo` is `\"red\"`; a colour is"),
        ];
        for (keys, expected) in cases {
            let message = load(keys).expect_err(keys);
            assert!(message.starts_with(expected), "{message}\ninstead of {expected}");
        }
        let misspelt = load("albedo = 1\nmean_free_path = 1\n[materials.x]\ntype = \"subsurfac\"").unwrap_err();
        assert!(misspelt.contains("subsurface"), "{misspelt}");
        let mixed = "albedo = 1\nmean_free_path = 1\n[materials.x]\ntype = \"mix\"\nfirst = \"wax\"\nsecond = \"wax\"";
        let message = load(mixed).unwrap_err();
        assert!(message.contains("without subsurface"), "{message}");
    }
}
