//! The places that deserve a look, worst first.

use std::collections::BTreeMap;

use glam::DVec3;

use super::facts::Evidence;
use crate::verify::{Finding, FindingKind};

/// Places that are shown.
const MOST: usize = 10;

/// Of these, places without light, and places where a tag keeps a failing light away; unless nothing else is left to show.
const MOST_OF_A_KIND: usize = 3;

/// Troubles of a kind on one object this near (share of the scene's extent) count as one.
const TOGETHER: f64 = 0.03;

/// Uncovered surface below this share of the scene's is not worth a place.
const LEAST_UNCOVERED: f64 = 2e-4;

/// What is wrong at a place. In order of severity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Trouble {
    /// A light lights the surface that it stands for.
    LightsItself,
    /// A light comes out on another side.
    PokesOut,
    /// Both sides of the surface reflect, so its light cannot hide behind it.
    Sheet,
    /// The light is a sliver.
    Sliver,
    /// No light stands for the surface.
    Uncovered,
    /// The light lies far from its surface.
    Far,
}

/// A place and its trouble.
#[derive(Clone, Debug)]
pub struct WorstPlace {
    /// What is wrong.
    pub trouble: Trouble,
    /// A tag mends it.
    pub tagged: bool,
    /// Node path.
    pub object: String,
    /// The material's name.
    pub material: String,
    /// World space, metres.
    pub place: DVec3,
    /// Unit normal of the surface there.
    pub normal: DVec3,
    /// By how much, metres; for uncovered surface its square metres.
    pub amount: f64,
    /// The light.
    pub light: Option<u32>,
    /// Further troubles of the kind near by.
    pub more: usize,
}

/// The places to show. `error_end_m` is what all but a hundredth of the surface's distances stay below, metres.
pub fn worst_places(evidence: &Evidence, error_end_m: f64) -> Vec<WorstPlace> {
    let [low, high] = evidence.scene.bounds().unwrap_or_default();
    let together = TOGETHER * (high - low).max_element();
    let (tagged, open): (Vec<_>, Vec<_>) = findings(evidence).into_iter().partition(|p| p.tagged);
    let mut kinds = [open, uncovered(evidence), tagged, far(evidence, error_end_m)]
        .map(|places| merged(places, together).into_iter().peekable());
    let mut shown: Vec<WorstPlace> = kinds[0].by_ref().take(MOST).collect();
    for places in &mut kinds[1..] {
        let room = MOST.saturating_sub(shown.len()).min(MOST_OF_A_KIND);
        shown.extend(places.take(room));
    }
    for places in &mut kinds[1..] {
        let room = MOST.saturating_sub(shown.len());
        shown.extend(places.take(room));
    }
    shown
}

/// Worst first; a place near a worse one of its kind and object only counts there.
fn merged(mut places: Vec<WorstPlace>, together: f64) -> Vec<WorstPlace> {
    places.sort_by(|a, b| b.amount.total_cmp(&a.amount).then(a.light.cmp(&b.light)));
    let mut kept: Vec<WorstPlace> = Vec::new();
    for place in places {
        let near = |k: &&mut WorstPlace| {
            k.trouble == place.trouble && k.object == place.object && k.place.distance(place.place) < together
        };
        // Beyond a few times what is shown, the rest only slows this down.
        let is_full = kept.len() >= 4 * MOST;
        match kept.iter_mut().find(near) {
            Some(worse) => worse.more += 1,
            None if is_full => {}
            None => kept.push(place),
        }
    }
    kept
}

fn findings(evidence: &Evidence) -> Vec<WorstPlace> {
    let place = |f: &Finding| WorstPlace {
        trouble: match f.kind {
            FindingKind::TooThin => Trouble::Sliver,
            _ if evidence.is_sheet(f.light) => Trouble::Sheet,
            FindingKind::LightsItself => Trouble::LightsItself,
            FindingKind::PokesOut => Trouble::PokesOut,
        },
        tagged: f.tagged,
        object: f.object.clone(),
        material: material_of_light(evidence, f.light),
        place: f.place,
        normal: f.normal,
        amount: f.depth_m,
        light: Some(f.light),
        more: 0,
    };
    evidence.verification.findings.iter().map(place).collect()
}

fn material_of_light(evidence: &Evidence, light: u32) -> String {
    let primitive = evidence.primitive_of_light(light as usize);
    primitive.map_or_else(String::new, |p| evidence.material_name(p).to_owned())
}

/// The paths of the object of a triangle of the patches, and its material's name.
fn names_of(evidence: &Evidence, triangle: u32) -> (String, String) {
    let primitive = evidence.patches.region(triangle as usize).primitive;
    let object = evidence.scene.primitives[primitive as usize].object;
    (evidence.scene.objects[object as usize].path.clone(), evidence.material_name(primitive).to_owned())
}

/// One place per region with uncovered surface: its uncovered point nearest to the mean of them.
fn uncovered(evidence: &Evidence) -> Vec<WorstPlace> {
    let verification = evidence.verification;
    let mut of_region: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (p, light) in verification.light_of_point.iter().enumerate() {
        let point = &verification.points[p];
        if light.is_none() && point.area > 0.0 {
            let region = evidence.patches.triangle_region[point.triangle as usize];
            of_region.entry(region).or_default().push(p);
        }
    }
    let visible: f64 = verification.points.iter().map(|p| p.area).sum();
    let place = |points: &Vec<usize>| {
        let points = || points.iter().map(|&p| &verification.points[p]);
        let amount: f64 = points().map(|p| p.area).sum();
        let mean = points().map(|p| p.position).sum::<DVec3>() / points().count() as f64;
        let away = |p: &&crate::surface::SurfacePoint| p.position.distance_squared(mean);
        let nearest = points().min_by(|a, b| away(a).total_cmp(&away(b)))?;
        let (object, material) = names_of(evidence, nearest.triangle);
        (amount >= LEAST_UNCOVERED * visible).then_some(WorstPlace {
            trouble: Trouble::Uncovered,
            tagged: false,
            object,
            material,
            place: nearest.position,
            normal: nearest.normal,
            amount,
            light: None,
            more: 0,
        })
    };
    of_region.values().filter_map(place).collect()
}

/// Points far from their lights: beyond what all but a hundredth of the surface keeps, and well beyond the clearance.
fn far(evidence: &Evidence, error_end_m: f64) -> Vec<WorstPlace> {
    let verification = evidence.verification;
    let least = error_end_m.max(4.0 * verification.required_m);
    let place = |(p, light): (usize, &Option<u32>)| {
        let point = &verification.points[p];
        // Points without area are many at small triangles, and some are the lights' samples.
        let light = (*light).filter(|_| point.area > 0.0)?;
        let fact = evidence.light_fact(light as usize, point.inner, point.normal);
        let amount = fact.distance_m - verification.required_m;
        (amount > least).then(|| names_of(evidence, point.triangle)).map(|(object, material)| WorstPlace {
            trouble: Trouble::Far,
            tagged: false,
            object,
            material,
            place: point.position,
            normal: point.normal,
            amount,
            light: Some(light),
            more: 0,
        })
    };
    verification.light_of_point.iter().enumerate().filter_map(place).collect()
}

#[cfg(test)]
pub mod tests {
    use super::*;

    pub fn at(x: f64, amount: f64) -> WorstPlace {
        WorstPlace {
            trouble: Trouble::LightsItself,
            tagged: false,
            object: "Room/Wall".to_owned(),
            material: "brick".to_owned(),
            place: DVec3::X * x,
            normal: DVec3::Y,
            amount,
            light: Some(0),
            more: 0,
        }
    }

    #[test]
    fn places_near_a_worse_one_count_there() {
        let found = merged(vec![at(0.0, 1.0), at(0.5, 3.0), at(9.0, 2.0)], 1.0);
        assert_eq!(found.iter().map(|p| (p.amount, p.more)).collect::<Vec<_>>(), [(3.0, 1), (2.0, 0)]);
        let other = WorstPlace { object: "Room/Floor".to_owned(), ..at(0.5, 2.5) };
        assert_eq!(merged(vec![at(0.5, 3.0), other], 1.0).len(), 2, "another object is another place");
    }
}
