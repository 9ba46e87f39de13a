//! t
use vlm_bake::{
    decimate::decimate,
    options::*,
    patches::patches,
    scene::{LoadOptions, load},
};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let file = vlm_format::GltfFile::open(a[1].as_ref()).unwrap();
    let scene = load(&file, &LoadOptions::default()).unwrap();
    let o = BakeOptions::preset(Preset::Game, scene.triangles.len());
    let p = patches(&scene, &scene.triangle_surfaces(), o.lights);
    println!(
        "tris {} regions {} islands {} verts {}",
        p.triangles.len(),
        p.regions.len(),
        p.islands,
        p.positions.len()
    );
    println!("two-sided {}", p.triangle_two_sided.iter().filter(|x| **x).count());
    let (m, d) = decimate(&p, &o);
    println!("{d:?} {}", m.faces.len());
    let mut q = p.clone();
    q.triangle_region.iter_mut().for_each(|r| *r = 0);
    let (m, d) = decimate(&q, &o);
    println!("no regions {d:?} {}", m.faces.len());
}
