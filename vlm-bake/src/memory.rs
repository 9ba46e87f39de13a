//! What a bake remembers for the next one of nearly the same scene, so that a changed colour moves no light and traces no ray.
//!
//! The costly stages stand behind a fingerprint of all that they look at. Where it is that of the last bake, so is the result: the
//! bytes are those of a bake that remembers nothing, whatever was edited before.

use blake3::{Hash, Hasher};
use bytemuck::NoUninit;
use vlm_format::Grid;
use vlm_shaders::cpu::punctual::PunctualLight;

use crate::bake::Mended;
use crate::grid::{GridInput, GridOptions};
use crate::options::BakeOptions;
use crate::patches::Patches;
use crate::scene::Scene;

/// The results of the last bake: about as large as the file that it made. Use one for each file.
#[derive(Default)]
pub struct Memory {
    pub(crate) mended: Last<Mended>,
    pub(crate) grid: Last<Option<Grid>>,
}

/// The last result of a stage.
pub(crate) struct Last<T>(Option<(Hash, T)>);

impl<T> Default for Last<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T> Last<T> {
    /// The result of the same input, and whether it was remembered.
    ///
    /// # Errors
    /// That of `make`; then nothing is remembered.
    pub(crate) fn get_or_try<E>(
        &mut self,
        input: Hash,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<(&T, bool), E> {
        let last = self.0.take().filter(|(of, _)| *of == input);
        let is_known = last.is_some();
        let last = match last {
            Some(last) => last,
            None => (input, make()?),
        };
        Ok((&self.0.insert(last).1, is_known))
    }
}

/// All that lights and their places depend on before they have colours.
pub(crate) fn of_shape(scene: &Scene, patches: &Patches, options: &BakeOptions) -> Hash {
    let mut hasher = Fingerprint::default();
    hasher.text(&format!("{:?}", BakeOptions { grid: GridOptions::default(), ..options.clone() }));
    hasher.visible(scene);
    for object in &scene.objects {
        hasher.values(&object.world_from_node.to_cols_array());
        hasher.values(&[object.steering.density]);
    }
    for mesh in &scene.authored {
        hasher.text(&format!("{:?}", mesh.mode));
        hasher.number(mesh.triangles.len());
    }
    hasher.values(&patches.positions);
    hasher.values(&patches.vertex_object);
    hasher.values(&patches.triangles);
    hasher.values(&patches.triangle_source);
    hasher.values(&patches.twins.iter().map(|&(a, b)| [a, b]).collect::<Vec<_>>());
    hasher.values(&patches.triangle_two_sided.iter().map(|&two| u8::from(two)).collect::<Vec<_>>());
    hasher.values(&patches.triangle_region);
    let region = |r: &crate::patches::Region| [r.primitive, r.island, u32::from(r.two_sided)];
    hasher.values(&patches.regions.iter().map(region).collect::<Vec<_>>());
    hasher.finish()
}

/// All that the grid depends on but for what it merely carries along: colours of surface without a light, gains and shares.
pub(crate) fn of_grid(input: &GridInput, options: &GridOptions) -> Hash {
    let scene = input.trace.scene;
    let mut hasher = Fingerprint::default();
    hasher.text(&format!("{options:?}"));
    hasher.visible(scene);
    hasher.values(&scene.vertex_normals);
    hasher.values(&scene.volumes);
    for primitive in &scene.primitives {
        let sides = scene.materials.get(primitive.material as usize).map(|m| (m.reflects, m.two_sided));
        hasher.text(&format!("{sides:?}"));
    }
    input.trace.lights().iter().for_each(|light: &PunctualLight| hasher.text(&format!("{light:?}")));
    let lights = input.lights;
    hasher.values(&lights.geometry);
    hasher.values(&lights.tags);
    hasher.values(&lights.sample_starts);
    hasher.values(&lights.samples.iter().map(|s| [s.position, s.normal]).collect::<Vec<_>>());
    hasher.values(input.light_of_sample);
    hasher.values(input.area_gains);
    hasher.values(input.shares);
    hasher.values(input.made);
    hasher.values(&input.uncovered.iter().map(|u| [u.position, u.normal]).collect::<Vec<_>>());
    hasher.values(&input.uncovered.iter().map(|u| u.area).collect::<Vec<_>>());
    input.stand_ins.arrays(|bytes| hasher.bytes(bytes));
    hasher.finish()
}

/// Accumulates arrays, each after its length.
#[derive(Default)]
struct Fingerprint(Hasher);

impl Fingerprint {
    fn bytes(&mut self, bytes: &[u8]) {
        self.number(bytes.len());
        self.0.update(bytes);
    }

    fn number(&mut self, number: usize) {
        self.0.update(&(number as u64).to_le_bytes());
    }

    fn values<T: NoUninit>(&mut self, values: &[T]) {
        self.bytes(bytemuck::cast_slice(values));
    }

    fn text(&mut self, text: &str) {
        self.bytes(text.as_bytes());
    }

    /// The visible triangles, and which of them belong together.
    fn visible(&mut self, scene: &Scene) {
        self.values(&scene.positions);
        self.values(&scene.triangles);
        self.values(&scene.triangle_primitive);
        self.values(&scene.primitives.iter().map(|p| p.object).collect::<Vec<_>>());
    }

    fn finish(&self) -> Hash {
        self.0.finalize()
    }
}
