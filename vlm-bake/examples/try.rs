//! try
use vlm_bake::{
    bake::bake,
    options::*,
    picture::*,
    progress::Silent,
    render::*,
    scene::{LoadOptions, load},
};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let t = std::time::Instant::now();
    let file = vlm_format::GltfFile::open(a[1].as_ref()).unwrap();
    let scene = load(&file, &LoadOptions::default()).unwrap();
    println!("load {:.2}", t.elapsed().as_secs_f64());
    let mut o = BakeOptions::preset(Preset::Game, scene.triangles.len());
    if let Some(n) = a.get(2) {
        if n != "-" {
            o.lights = n.parse().unwrap();
        }
    }
    let b = bake(&scene, &o, &Silent).unwrap();
    println!("total {:.2}", t.elapsed().as_secs_f64());
    let mut r = b.report.clone();
    let tags = r.tags.len();
    r.tags.truncate(3);
    println!("{} tags {}", serde_json::to_string_pretty(&r).unwrap(), tags);
    if let Some(m) = a.get(3) {
        let mut cams = scene.cameras.clone();
        if cams.is_empty() {
            cams.push(vlm_bake::camera::framing_camera(&scene));
        }
        let (w, h, spp) = (a[4].parse().unwrap(), a[5].parse().unwrap(), a[6].parse().unwrap());
        let (_, mut truth): (f64, Vec<glam::Vec3>) = (0.0, vec![]);
        for (name, method) in
            [("reference", Method::Reference), ("brute", Method::Brute), ("vlm", Method::Vlm)]
        {
            if !m.contains(&name[..1]) {
                continue;
            }
            let t = std::time::Instant::now();
            let im = render(
                &scene,
                Some(&b.asset),
                &cams[0],
                &RenderOptions { width: w, height: h, method, samples: spp },
                &|_| {},
            )
            .unwrap();
            write_png(&im, format!("/tmp/{name}.png").as_ref(), None).unwrap();
            if name == "reference" {
                truth = im.indirect.clone();
            }
            let n: f64 = im.indirect.iter().zip(&truth).map(|(a, b)| (*a - *b).length_squared() as f64).sum();
            let d: f64 = truth.iter().map(|b| b.length_squared() as f64).sum();
            let ea: f64 = im.indirect.iter().map(|b| b.element_sum() as f64).sum();
            let eb: f64 = truth.iter().map(|b| b.element_sum() as f64).sum();
            println!(
                "{name} {:.2}s relrmse {:.4} energy {:+.3} {:?}",
                t.elapsed().as_secs_f64(),
                (n / d).sqrt(),
                ea / eb - 1.0,
                im.stats
            );
        }
    }
}
