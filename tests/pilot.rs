use crate::support::*;
use sampling::sampler::SamplerKind;
use serde_json::json;
#[test]
fn pilot() {
    let which = std::env::var("SCENES")
        .unwrap_or("cornell_box veach_mis glass_caustic indirect_lamp furnace integrating_sphere".into());
    let samples: u32 = std::env::var("SPP").map_or(64, |s| s.parse().unwrap());
    for name in which.split_whitespace() {
        let scene = builtin(name, 16);
        for (m, s) in [
            ("direct", json!({})),
            ("path", json!({"roulette":"none"})),
            ("light", json!({"roulette":"none"})),
            ("bdpt", json!({})),
        ] {
            let method = method_with(m, s);
            let budget = Budget { sampler: SamplerKind::Stratified, ..Budget::samples(samples) };
            let t = std::time::Instant::now();
            let r = measure(&scene, method.as_ref(), m, budget);
            let n = 256.0 * 64.0 * samples as f64;
            print!("{name} {m}: {:.2} us;", t.elapsed().as_secs_f64() * 1e6 / n);
            for k in method.orders(8) {
                let e = r.image(k);
                print!(
                    " {k}:{:.2e} cv {:.2} sk {:.1}",
                    e.mean,
                    e.error / e.mean * f64::sqrt(n),
                    e.skewness * 64f64.sqrt()
                );
            }
            println!();
        }
    }
}
