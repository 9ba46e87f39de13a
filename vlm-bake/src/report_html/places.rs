//! The places that deserve a look, worst first, and what to do about each.

use std::collections::BTreeMap;

use glam::DVec3;

use super::facts::Evidence;
use super::objects::percent;
use super::stand_in::FindingKind;
use super::text::{length, node};

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
    /// Nothing lies behind the surface, so its light cannot hide.
    TooThin,
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

impl WorstPlace {
    /// In a few words.
    pub fn title(&self) -> &'static str {
        match self.trouble {
            Trouble::LightsItself => "A light lights its own surface",
            Trouble::PokesOut => "A light comes out of its object",
            Trouble::TooThin => "Nothing to hide a light behind",
            Trouble::Uncovered => "No light stands for this surface",
            Trouble::Far => "Light far from its surface",
        }
    }

    /// What is wrong, with figures. `required_m` is the clearance, `visible_m2` the area of the scene.
    pub fn problem(&self, required_m: f64, visible_m2: f64) -> String {
        let by = length(self.amount);
        match self.trouble {
            Trouble::LightsItself => {
                format!(
                    "It would have to lie {by} deeper to keep the required {} behind it.",
                    length(required_m)
                )
            }
            Trouble::PokesOut => format!("It shows on another side, by {by}."),
            Trouble::TooThin => {
                format!("The surface is a sheet or thinner than the lights need; they come {by} too near.")
            }
            Trouble::Uncovered => format!(
                "{:.3} m², {} of the scene's surface, bounce no light: too small or too isolated for the budget.",
                self.amount,
                percent(self.amount / visible_m2.max(f64::MIN_POSITIVE))
            ),
            Trouble::Far => format!(
                "It lies {by} farther from here than the clearance asks: decimation cut this shape away, or the light sank."
            ),
        }
    }

    /// What to do about it.
    pub fn advice(&self, required_m: f64) -> String {
        let name = node(&self.object);
        let thick = length(4.0 * required_m);
        match (self.trouble, self.tagged) {
            (Trouble::LightsItself | Trouble::PokesOut, true) => {
                "A tag already keeps this light off its own surface, so nothing shines through. To be rid of the tag, smooth or simplify the \
                 shape here, or ask for more lights.".to_owned()
            }
            (Trouble::LightsItself, false) => format!(
                "Raise extras.vlm.density on {name} (try 2) or ask for more lights; if it stays, set extras.vlm.tag on it."
            ),
            (Trouble::PokesOut, false) => format!(
                "Make {name} at least {thick} thick here, or raise extras.vlm.density on it; if it stays, set extras.vlm.tag on it."
            ),
            (Trouble::TooThin, true) => format!(
                "Fine as it is if {name} is meant to be a sheet: its tag keeps its lights off it. Otherwise close it into a solid at \
                 least {thick} thick, single-sided."
            ),
            (Trouble::TooThin, false) => format!(
                "Close {name} into a solid at least {thick} thick, or set extras.vlm.tag on it; set extras.vlm.exclude if its light does \
                 not matter."
            ),
            (Trouble::Uncovered, _) => format!(
                "If its light matters, raise extras.vlm.density on {name} or join it to the surface that it touches; if not, leave it."
            ),
            (Trouble::Far, _) => format!(
                "Compare the pictures of the scene and of the lights: if the shape matters, raise extras.vlm.density on {name}."
            ),
        }
    }
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
    let place = |f: &super::stand_in::Finding| WorstPlace {
        trouble: match f.kind {
            FindingKind::LightsItself => Trouble::LightsItself,
            FindingKind::PokesOut => Trouble::PokesOut,
            FindingKind::TooThin => Trouble::TooThin,
        },
        tagged: f.tagged,
        object: f.object.clone(),
        place: f.place,
        normal: f.normal,
        amount: f.depth_m,
        light: Some(f.light),
        more: 0,
    };
    evidence.verification.findings.iter().map(place).collect()
}

/// The path of the object of a triangle of the patches.
fn path_of(evidence: &Evidence, triangle: u32) -> String {
    let region = evidence.verification.patches.region(triangle as usize);
    let object = evidence.scene.primitives[region.primitive as usize].object;
    evidence.scene.objects[object as usize].path.clone()
}

/// One place per region with uncovered surface: its uncovered point nearest to the mean of them.
fn uncovered(evidence: &Evidence) -> Vec<WorstPlace> {
    let verification = evidence.verification;
    let mut of_region: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (p, light) in verification.light_of_point.iter().enumerate() {
        let point = &verification.points[p];
        if light.is_none() && point.area > 0.0 {
            let region = verification.patches.triangle_region[point.triangle as usize];
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
        (amount >= LEAST_UNCOVERED * visible).then(|| WorstPlace {
            trouble: Trouble::Uncovered,
            tagged: false,
            object: path_of(evidence, nearest.triangle),
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
        let light = (*light)?;
        let fact = evidence.light_fact(light as usize, point.position, point.normal);
        let amount = fact.distance_m - verification.required_m;
        (amount > least).then(|| WorstPlace {
            trouble: Trouble::Far,
            tagged: false,
            object: path_of(evidence, point.triangle),
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
mod tests {
    use super::*;

    fn at(x: f64, amount: f64) -> WorstPlace {
        WorstPlace {
            trouble: Trouble::LightsItself,
            tagged: false,
            object: "Room/Wall".to_owned(),
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

    #[test]
    fn advice_names_the_object_and_differs_with_the_tag() {
        let open = at(0.0, 0.01);
        assert!(open.advice(1e-3).contains("density on Wall"), "{}", open.advice(1e-3));
        assert_ne!(open.advice(1e-3), WorstPlace { tagged: true, ..open.clone() }.advice(1e-3));
    }
}
