//! Which probes a change of some lights reaches.

use vlm_format::Grid;
use vlm_shaders::cpu::upload::LightSet;

/// Groups of neighbouring elements that are told apart, at most: more of them reach fewer probes in vain, at a bit a probe each.
const GROUPS: usize = 256;
const WORDS: usize = GROUPS / 64;

/// Above this share of all probes, refreshing all of them is as cheap.
const MOST_PROBES: f32 = 0.9;

/// A bit for each group of elements.
type Groups = [u64; WORDS];

/// For each probe, from which groups of elements light arrives. An element is a light with its samples, or a piece of surface without one;
/// their order follows the surface, so that a group is a neighbourhood.
pub(crate) struct Dependents {
    groups_of_probe: Vec<Groups>,
    elements: usize,
}

impl Dependents {
    pub(crate) fn new(grid: &Grid, lights: &LightSet) -> Self {
        let elements = lights.len() + grid.uncovered.len();
        let group_of_source = group_of_source(lights, elements);
        let of_probe = |probe: usize| {
            let mut groups = Groups::default();
            let far = grid.row(probe).map(|(source, _)| source);
            for source in far {
                set(&mut groups, group_of_source.get(source as usize).copied());
            }
            for light in grid.near_of(probe) {
                set(&mut groups, Some(group(*light as usize, elements)));
            }
            groups
        };
        Self { groups_of_probe: (0..grid.probes.len()).map(of_probe).collect(), elements }
    }

    /// The probes that get light from some of these elements, ascending; `None` where refreshing all is as cheap.
    pub(crate) fn of(&self, elements: &[u32]) -> Option<Vec<u32>> {
        let mut changed = Groups::default();
        elements.iter().for_each(|&element| set(&mut changed, Some(group(element as usize, self.elements))));
        let is_reached = |(_, groups): &(u32, &Groups)| {
            groups.iter().zip(&changed).any(|(own, changed)| own & changed != 0)
        };
        let probes: Vec<u32> =
            (0..).zip(&self.groups_of_probe).filter(is_reached).map(|(probe, _)| probe).collect();
        let is_few = (probes.len() as f32) < MOST_PROBES * self.groups_of_probe.len() as f32;
        is_few.then_some(probes)
    }
}

/// The group of each source: samples by their light, lights, pieces.
fn group_of_source(lights: &LightSet, elements: usize) -> Vec<usize> {
    let mut groups = vec![0; lights.samples.len()];
    for light in 0..lights.len() {
        let own = lights.sample_range(light).and_then(|range| groups.get_mut(range));
        own.into_iter().flatten().for_each(|of_sample| *of_sample = group(light, elements));
    }
    groups.extend((0..elements).map(|element| group(element, elements)));
    groups
}

fn group(element: usize, elements: usize) -> usize {
    element * GROUPS / elements.max(1)
}

fn set(groups: &mut Groups, group: Option<usize>) {
    if let Some((word, group)) = group.and_then(|group| Some((groups.get_mut(group / 64)?, group))) {
        *word |= 1 << (group % 64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vlm_format::{Probe, RowWriter};

    /// 512 lights of two samples each, and 512 probes, each of which sees one sample of the light of its number and has the next light near;
    /// the last three see pieces.
    fn grid() -> (Grid, LightSet) {
        let lights = LightSet {
            geometry: vec![Default::default(); 512],
            sample_starts: (0..=512).map(|light| 2 * light).collect(),
            samples: vec![vlm_format::Sample::default(); 1024],
            ..LightSet::default()
        };
        let mut rows = RowWriter::default();
        let source = |probe: u32| if probe < 509 { 2 * probe + 1 } else { 1024 + 512 + probe - 509 };
        (0..512).for_each(|probe| rows.push(0, [(source(probe), 100)]));
        let near = |probe: u32| (probe + 1).min(511);
        (0..512).for_each(|probe| rows.push(2 * near(probe), [(2 * near(probe), 100)]));
        let grid = Grid {
            probes: vec![Probe::default(); 512],
            near_starts: (0..=512).collect(),
            near: (0..512).map(near).collect(),
            uncovered: vec![Default::default(); 3],
            row_starts: rows.starts,
            rows: rows.words,
            ..Grid::default()
        };
        (grid, lights)
    }

    #[test]
    fn probes_that_a_change_reaches_and_few_others() {
        let (grid, lights) = grid();
        let dependents = Dependents::new(&grid, &lights);
        for element in [0, 1, 100, 300, 508] {
            let probes = dependents.of(&[element]).unwrap_or_default();
            assert!(probes.contains(&element), "far, {element}: {probes:?}");
            assert!(element == 0 || probes.contains(&(element - 1)), "near, {element}: {probes:?}");
            assert!(probes.len() <= 4 && probes.is_sorted(), "{probes:?}");
        }
        assert!(dependents.of(&[512 + 2]).unwrap_or_default().contains(&511), "a piece");
        assert_eq!(dependents.of(&[]), Some(Vec::new()), "the negative control");
    }

    #[test]
    fn where_most_are_reached_all_are_refreshed() {
        let (grid, lights) = grid();
        let all: Vec<u32> = (0..512).collect();
        assert_eq!(Dependents::new(&grid, &lights).of(&all), None);
    }
}
