use integrators::*; use sampling::sampler::*; use sampling::bsdf::*; use sampling::math::Spectrum; use scenes::*; use glam::*;
fn main(){
  let mut b = SceneBuilder::new("x");
  let m = b.material(Bsdf::from(Lambert{albedo: Spectrum::splat(0.5)}));
  let s = b.sphere(DVec3::ZERO, 1.0, m); b.flip(s);
  b.emit(s, Emission{radiance: scenes::texture::Texture::Constant(Spectrum::splat(1.0)), two_sided:false});
  b.camera(CameraSettings{position: dvec3(0.3,0.2,0.5), target: dvec3(0.,0.,-1.), up: DVec3::Y, fov: 50., width: 16, height: 16});
  let scene = b.build(Skip::Unneeded).unwrap();
  for name in ["direct","path","light","bdpt"] {
    let method = Methods::standard().build(name, &serde_json::json!({})).unwrap();
    let mut r = Render::new(&scene, method.as_ref(), RenderSettings{orders: Orders::up_to(6), tail:false, samples_per_replicate: 64, seed:1, sampler: SamplerKind::Independent, instance: name.into(), role: Role::Estimate}).unwrap();
    for _ in 0..8 { r.run_replicate(&|_|{}); }
    let m = r.finish();
    print!("{name:7}"); for k in 0..=6 { let t=0.5f64.powi(k); print!(" {:.4}({:+.1})", m.image_mean(k as usize)[0]/t, (m.image_mean(k as usize)[0]-t)/m.image_mean_error(k as usize).unwrap()[0].max(1e-9)); }
    println!("  {:.2} us/sample {:?}", m.seconds()*2e6/(256.*512.), m.invalid);
  }
}
