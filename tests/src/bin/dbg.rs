//! dbg
use vlm_bake::{bake::bake, options::*, progress::Silent, scene::*, shade::TraceScene, render::*, gbuffer::GBuffer};
use vlm_shaders::cpu::{grid::*, resolve::luminance};
use vlm_shaders::cpu::gather::Receiver;
fn main() {
    let mut a = std::env::args().skip(1);
    let name = a.next().unwrap();
    let path = vlm_tests::pareto::scene::file(&name).unwrap();
    let file = vlm_format::GltfFile::open(&path).unwrap();
    let scene = load(&file, &LoadOptions::default()).unwrap();
    let mut o = BakeOptions::preset(Preset::Game, scene.triangles.len());
    if let Some(p) = a.next() { o.grid.probes = p.parse().unwrap(); }
    o.grid.rays = 16;
    let b = bake(&scene, &o, &Silent).unwrap();
    let trace = TraceScene::new(&scene);
    let g = b.asset.grid.as_ref().unwrap();
    println!("extent {:?}", scene.bounds());
    println!("leaves {} probes {} near {} far {} leafprobes {} bytes {}", g.leaves.len()-1, g.probes.len(), g.near.len(), g.row_starts.last().unwrap(), g.leaf_probes.len(), g.byte_len());
    let lit = LitScene::new(&trace, &b.asset).unwrap();
    {
        // true radiosity over all surface, by primitive, area-uniform
        let mut per = vec![(0.0f64,0.0f64,0.0f64,0.0f64,0.0f64); scene.primitives.len()];
        for t in 0..scene.triangles.len() as u32 {
            let [fr, _] = trace.lit_sides(t); if !fr { continue; }
            let c = scene.corners(t as usize).unwrap(); let a = 0.5*(c[1]-c[0]).cross(c[2]-c[0]).length() as f64;
            let n = ((a / 0.01) as u64).clamp(1, 3000);
            for i in 0..n {
                let b3 = vlm_bake::surface::uniform_barycentric(i + t as u64 * 7919);
                let h = vlm_bake::bvh::Hit { triangle: t, distance: 0.0, barycentric: b3, front: true };
                let Some(p) = trace.surface(&h, 0.0) else { continue };
                let w = a / n as f64; let pr = scene.triangle_primitive[t as usize] as usize;
                let e = luminance(trace.direct_irradiance(p.position, p.normal, p.geometric_normal)) as f64;
                let e2 = luminance(trace.direct_irradiance(p.position, p.geometric_normal, p.geometric_normal)) as f64;
                per[pr].0 += w * luminance(trace.reflected(&p)) as f64; per[pr].3 += w * e; per[pr].4 += w * e2;
                if let Some((l, r)) = b.stand_ins.light_at(t, b3, true) { per[pr].1 += w * (luminance(lit.radiosity[l as usize]) * r) as f64; per[pr].2 += w*(luminance(b.asset.albedo[l as usize])) as f64 * 0.0 + w; }
            }
        }
        let tot: f64 = per.iter().map(|p| p.0).sum(); let totl: f64 = per.iter().map(|p| p.1).sum();
        println!("ALL true {tot} lights {totl}");
        for (i, p) in per.iter().enumerate() { if (p.0 - p.1).abs() > 0.01 * tot { println!("   prim {i}: true {} lights {} area {} E {} Egeo {}", p.0, p.1, p.2, p.3, p.4); } }
    }
    let mut cams = scene.cameras.clone(); cams.extend(vlm_tests::pareto::scene::more_cameras(&name));
    for c in &cams {
        let gb = GBuffer::trace(&trace, c, 256, 144);
        let (mut noleaf, mut zero, mut n, mut nolight) = (0,0,0,0);
        let mut per = vec![(0.0,0.0); scene.primitives.len()]; let (mut bt, mut bl) = (0.0, 0.0);
        for p in gb.points.iter().flatten() {
            n += 1;
            match leaf_at(g, p.position) { None => noleaf += 1, Some(l) => {
                let bl = blend(g, l, &Receiver{position:p.position, normal:p.normal, geometric_normal:p.geometric_normal, tag:0});
                if bl.weights.iter().all(|w| *w==0.0) { zero += 1; }
            }}
            bt += luminance(trace.reflected(p)); let pr = scene.triangle_primitive[p.triangle as usize] as usize; per[pr].0 += luminance(trace.reflected(p));
            // find bary: shoot ray
            let o = p.position + p.geometric_normal*1e-3;
            if let Some(h) = trace.path_hit(o, -p.geometric_normal) {
                match b.stand_ins.light_at(h.triangle, h.barycentric, h.front) { None => nolight += 1, Some((l, r)) => { bl += luminance(lit.radiosity[l as usize]) * r; per[pr].1 += luminance(lit.radiosity[l as usize]) * r;} }
            }
        }
        let mut k = 0;
        for (i, p) in gb.points.iter().enumerate().filter_map(|(i,p)| p.as_ref().map(|p| (i,p))).step_by(97) {
            let o = p.position + p.geometric_normal*1e-3;
            if let Some(h) = trace.path_hit(o, -p.geometric_normal) && let Some((l, r)) = b.stand_ins.light_at(h.triangle, h.barycentric, h.front) {
                let t = luminance(trace.reflected(p)); let bl = luminance(lit.radiosity[l as usize]) * r;
                if (t - bl).abs() > 0.5 * t.max(bl) && t > 0.1 && k < 0 && scene.triangle_primitive[h.triangle as usize] == 46 { k += 1;
                    let geo = &lit.lights.geometry[l as usize];
                    let s = lit.lights.samples_of(l as usize);
                    println!("  pix {i} at {:?} n {:?} tri {} prim {} two {:?}: true {t} light {bl} = B {:?} * {r}; light {l} tag {} area {} n {:?} at {:?} albedo {:?} pixel albedo {:?} samples {:?}", p.position, p.geometric_normal, h.triangle, scene.triangle_primitive[h.triangle as usize], trace.lit_sides(h.triangle), lit.radiosity[l as usize], lit.lights.tags[l as usize], geo.area(), geo.normal.normalize(), geo.v0, b.asset.albedo[l as usize], p.albedo, s.iter().map(|s| (s.position, s.normal, s.reflectance, trace.direct_irradiance(s.position, s.normal, s.normal).x)).collect::<Vec<_>>());
                }
            }
        }
        for (i, (t, l)) in per.iter().enumerate() { if (t - l).abs() > 0.01 * bt { println!("   prim {i} {} two {}: {t} {l}", scene.materials[scene.primitives[i].material as usize].name, scene.materials[scene.primitives[i].material as usize].two_sided); } }
        println!("{}: pixels {n} no leaf {noleaf} zero weight {zero} no light {nolight} radiosity true {bt} lights {bl}", c.name);
    }
    println!("{:?}", b.report.seconds);
}
