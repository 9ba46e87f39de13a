//! What is wrong at a place and what to do about it, in words.

use super::objects::percent;
use super::places::{Trouble, WorstPlace};
use super::text::{length, node};

impl WorstPlace {
    /// In a few words.
    pub fn title(&self) -> &'static str {
        match self.trouble {
            Trouble::LightsItself => "A light lights its own surface",
            Trouble::PokesOut => "A light comes out of its object",
            Trouble::Sheet => "Two-sided: nothing to hide a light behind",
            Trouble::Sliver => "A light is a sliver",
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
            Trouble::PokesOut => {
                format!(
                    "It shows on another side, or in front of its own: it would have to move by up to {by}."
                )
            }
            Trouble::Sheet => format!(
                "Both sides of this surface reflect, so whichever side a light lies on, it shines on the other. It would have to move by {by}."
            ),
            Trouble::Sliver => {
                "It is longer than 100 times its height: single precision cannot hold its light.".to_owned()
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
    pub fn advice(&self, remedies: &Remedies) -> String {
        let name = node(&self.object);
        let thick = length(4.0 * remedies.required_m);
        let (finer, last) = (remedies.finer(name), remedies.last_resort(name));
        match (self.trouble, self.tagged) {
            (Trouble::LightsItself, true) => format!(
                "A tag already keeps this light off its own surface, so nothing shines through. To be rid of the tag, smooth or simplify the \
                 shape here, or {finer}."
            ),
            (Trouble::PokesOut, true) => format!(
                "A tag already keeps this light off the surface that it reaches, so nothing shines through. To be rid of the tag, make \
                 {name} thicker here, or {finer}."
            ),
            (Trouble::LightsItself, false) => {
                format!("To mend it, {finer}. {last}")
            }
            (Trouble::PokesOut, false) => {
                format!("Make {name} thicker here, or {finer}. {last}")
            }
            (Trouble::Sheet, true) => format!(
                "Fine as it is if {name} is meant to be a sheet: a tag keeps its lights off it. Otherwise close it into a solid at least \
                 {thick} thick, single-sided."
            ),
            (Trouble::Sheet, false) => format!(
                "Close {name} into a solid at least {thick} thick, or set `extras.vlm.tag` on it; set `extras.vlm.exclude` if its light does \
                 not matter."
            ),
            (Trouble::Sliver, _) => {
                format!("If an artist made it, divide it into triangles of better shape. Otherwise {finer}.")
            }
            (Trouble::Uncovered, _) => format!(
                "If its light matters, {finer}, or join it to the surface that it touches. If not, leave it."
            ),
            (Trouble::Far, _) => {
                format!("Compare the pictures of the scene and of the lights; if the shape matters, {finer}.")
            }
        }
    }
}

/// What helps in this scene.
#[derive(Clone, Copy, Debug)]
pub struct Remedies {
    /// Required clearance, metres.
    pub required_m: f64,
    /// A budget to try next.
    pub more_lights: u32,
    /// The scene has several objects, so that one of them may get more of the budget.
    pub can_steer: bool,
}

impl Remedies {
    /// What to do where nothing else helps. A tag on all of a scene would darken it.
    fn last_resort(&self, name: &str) -> String {
        if self.can_steer {
            format!("If it stays, set `extras.vlm.tag` on {name}.")
        } else {
            "If it stays, make this part an object of its own and set `extras.vlm.tag` on it.".to_owned()
        }
    }

    /// How to get more lights onto an object.
    pub fn finer(&self, name: &str) -> String {
        let more = self.more_lights;
        if self.can_steer {
            format!("raise `extras.vlm.density` on {name} (try 2), or bake with `--lights {more}`")
        } else {
            format!("bake with `--lights {more}`")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report_html::places::tests::at;

    #[test]
    fn advice_names_the_object_and_differs_with_the_tag() {
        let open = at(0.0, 0.01);
        let several = Remedies { required_m: 1e-3, more_lights: 920, can_steer: true };
        let advice = open.advice(&several);
        assert!(advice.contains("density` on Wall") && advice.contains("920"), "{advice}");
        assert_ne!(advice, WorstPlace { tagged: true, ..open.clone() }.advice(&several));
        let alone = open.advice(&Remedies { can_steer: false, ..several });
        assert!(!alone.contains("density"), "one object alone gains nothing by it: {alone}");
        assert!(advice.contains("tag` on Wall") && alone.contains("object of its own"), "{alone}");
    }
}
