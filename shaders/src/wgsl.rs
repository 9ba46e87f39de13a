//! The shaders' source, put together from `wgsl/` and `wgsl/shared/`. What each pass binds stands in the crate's README.

/// Functions that other shaders use: the form factor.
pub const FORM_FACTOR: &str = include_str!("../wgsl/shared/form_factor.wgsl");

/// Bindings of the shaders that measure form factors; after [`FORM_FACTOR`].
pub const RECEIVERS: &str = include_str!("../wgsl/shared/receivers.wgsl");

/// The static grid: bind group 0 of every pass, and the leaf that holds a point.
pub const GRID: &str = include_str!("../wgsl/shared/grid.wgsl");

/// Probes and their weights for a point; after [`GRID`].
pub const BLEND: &str = include_str!("../wgsl/shared/blend.wgsl");

/// A probe's far light; after [`BLEND`].
pub const FAR: &str = include_str!("../wgsl/shared/far.wgsl");

/// What phase 2 reads of the lights; after [`FORM_FACTOR`].
pub const LIGHTS: &str = include_str!("../wgsl/shared/lights.wgsl");

/// The function `gather_static` with its bindings, for shaders that light pixels; after [`LIGHTS`], [`GRID`], [`BLEND`] and [`FAR`].
pub const GATHER_STATIC: &str = include_str!("../wgsl/shared/gather_static.wgsl");

/// From a pixel's depth to its place.
pub const VIEW: &str = include_str!("../wgsl/shared/view.wgsl");

/// Irradiance by real lights, shadows aside.
pub const PUNCTUAL: &str = include_str!("../wgsl/shared/punctual.wgsl");

/// The rows of probes; after [`GRID`].
const ROWS: &str = include_str!("../wgsl/shared/rows.wgsl");

/// A point that phase 1 lights.
const POINT: &str = include_str!("../wgsl/shared/point.wgsl");

/// A point that is lit.
const RECEIVER: &str = include_str!("../wgsl/shared/receiver.wgsl");

/// The light around a probe in free space.
pub const FREE_LIGHT: &str = include_str!("../wgsl/shared/free_light.wgsl");

/// The function `gather_free` with its bindings, for shaders that light what moves; after [`GATHER_STATIC`] and [`FREE_LIGHT`].
pub const GATHER_FREE: &str = include_str!("../wgsl/shared/gather_free.wgsl");

/// A compute shader that finds one form factor per case; entry point `main`, 64 invocations per workgroup.
#[must_use]
pub fn form_factor_cases() -> String {
    format!("{FORM_FACTOR}\n{RECEIVERS}\n{}", include_str!("../wgsl/form_factor_cases.wgsl"))
}

/// A compute shader that sums the form factors of all lights at each receiver; entry point `main`, 64 invocations per
/// workgroup. Software devices stop loops after 65,535 rounds, so more lights need several dispatches.
#[must_use]
pub fn form_factor_sums() -> String {
    format!("{FORM_FACTOR}\n{RECEIVERS}\n{}", include_str!("../wgsl/form_factor_sums.wgsl"))
}

/// The direct light at the points that phase 1 lights; entry point `direct`, 64 invocations per workgroup, one per span of points.
#[must_use]
pub fn direct() -> String {
    [PUNCTUAL, POINT, include_str!("../wgsl/direct.wgsl")].join("\n")
}

/// The share of a light that the points of phase 1 see by one of its shadow maps; entry point `shadow`, 64 invocations per workgroup, one per
/// point.
#[must_use]
pub fn shadow() -> String {
    [POINT, include_str!("../wgsl/shared/shadow_map.wgsl"), include_str!("../wgsl/shadow.wgsl")].join("\n")
}

/// Phase 1: the radiosity of lights and sources; entry point `inject`, 64 invocations per workgroup, one per light and one per piece
/// of surface without one.
#[must_use]
pub fn inject() -> String {
    format!("{GRID}\n{}", include_str!("../wgsl/inject.wgsl"))
}

/// What arrives at the probes; entry point `refresh`, 64 invocations per workgroup, one per probe.
#[must_use]
pub fn refresh() -> String {
    format!("{GRID}\n{BLEND}\n{FAR}\n{ROWS}\n{}", include_str!("../wgsl/refresh.wgsl"))
}

/// What arrives at the probes in free space; entry point `refresh_free`, 64 invocations per workgroup, one per such probe.
#[must_use]
pub fn refresh_free() -> String {
    format!("{GRID}\n{BLEND}\n{FREE_LIGHT}\n{ROWS}\n{}", include_str!("../wgsl/refresh_free.wgsl"))
}

/// Phase 2 by the static grid at a list of receivers; entry point `gather`, 64 invocations per workgroup, one per receiver.
#[must_use]
pub fn gather_static() -> String {
    let receivers = include_str!("../wgsl/gather_static.wgsl");
    format!("{FORM_FACTOR}\n{LIGHTS}\n{GRID}\n{BLEND}\n{FAR}\n{GATHER_STATIC}\n{RECEIVER}\n{receivers}")
}

/// Phase 2 at a list of receivers that move; entry point `gather_moving`, 64 invocations per workgroup, one per receiver.
#[must_use]
pub fn gather_free() -> String {
    let receivers = include_str!("../wgsl/gather_free.wgsl");
    let gather = format!("{GATHER_STATIC}\n{FREE_LIGHT}\n{GATHER_FREE}");
    format!("{FORM_FACTOR}\n{LIGHTS}\n{GRID}\n{BLEND}\n{FAR}\n{gather}\n{RECEIVER}\n{receivers}")
}

/// What the gathering of an asset needs, so that shaders hold nothing for what it lacks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Gathering {
    /// Light comes through the static grid.
    pub grid: bool,
    /// A list of lights is summed at every point: all of them without a grid, those that moved with one.
    pub listed: bool,
    /// Listed lights may have tags.
    pub tags: bool,
    /// The grid has probes in free space, which light what moves.
    pub free: bool,
}

impl Gathering {
    /// All that there are.
    pub const ALL: [Self; 8] = [
        Self { grid: true, listed: false, tags: false, free: false },
        Self { grid: false, listed: true, tags: false, free: false },
        Self { grid: false, listed: true, tags: true, free: false },
        Self { grid: true, listed: true, tags: false, free: false },
        Self { grid: true, listed: true, tags: true, free: false },
        Self { grid: true, listed: false, tags: false, free: true },
        Self { grid: true, listed: true, tags: false, free: true },
        Self { grid: true, listed: true, tags: true, free: true },
    ];

    /// The functions `indirect(position, normal, geometric_normal, tag) -> Gathered` for what stands still, and `indirect_moving` of the same
    /// parameters for what moves, with their bindings in the groups 0 and 1.
    #[must_use]
    pub fn indirect(self) -> String {
        let tags = if self.tags {
            include_str!("../wgsl/shared/tags.wgsl")
        } else {
            include_str!("../wgsl/shared/no_tags.wgsl")
        };
        let by_grid = [BLEND, FAR, GATHER_STATIC];
        let by_list = [tags, include_str!("../wgsl/shared/gather_listed.wgsl")];
        let mut parts = vec![FORM_FACTOR, LIGHTS, GRID];
        if self.grid {
            parts.extend(by_grid);
        }
        if self.free {
            parts.extend([FREE_LIGHT, GATHER_FREE]);
        }
        if self.listed {
            parts.extend(by_list);
        }
        parts.push(match (self.grid, self.listed) {
            (_, false) => include_str!("../wgsl/shared/indirect_grid.wgsl"),
            (false, true) => include_str!("../wgsl/shared/indirect_listed.wgsl"),
            (true, true) => include_str!("../wgsl/shared/indirect_moving.wgsl"),
        });
        parts.push(match (self.free, self.listed) {
            (false, _) => include_str!("../wgsl/shared/moving_as_still.wgsl"),
            (true, false) => include_str!("../wgsl/shared/moving_free.wgsl"),
            (true, true) => include_str!("../wgsl/shared/moving_free_listed.wgsl"),
        });
        parts.join("\n")
    }

    /// [`Gathering::indirect`] for a forward shader, with its bindings in the groups `first_group` and the next.
    #[must_use]
    pub fn forward(self, first_group: u32) -> String {
        let group = |number: u32| format!("@group({number})");
        let source = self.indirect().replace("@group(1)", "@group(second)");
        source.replace("@group(0)", &group(first_group)).replace("@group(second)", &group(first_group + 1))
    }

    /// Phase 2 at every pixel of a G-buffer; entry point `gather`, 8 x 8 invocations per workgroup. `counted` counts the pairs, `float` writes
    /// single precision in place of halves.
    #[must_use]
    pub fn deferred(self, counted: bool, float: bool) -> String {
        let tags = if self.tags {
            include_str!("../wgsl/shared/tag_texture.wgsl")
        } else {
            include_str!("../wgsl/shared/no_tag_texture.wgsl")
        };
        let count = if counted {
            include_str!("../wgsl/shared/count.wgsl")
        } else {
            include_str!("../wgsl/shared/no_count.wgsl")
        };
        let moving = if self.free {
            include_str!("../wgsl/shared/moving_texture.wgsl")
        } else {
            include_str!("../wgsl/shared/no_moving_texture.wgsl")
        };
        let gather = include_str!("../wgsl/gather_deferred.wgsl");
        let gather = if float { gather.replace("rgba16float", "rgba32float") } else { gather.to_owned() };
        [&self.indirect(), VIEW, tags, moving, count, &gather].join("\n")
    }

    fn name(self) -> &'static str {
        match (self.grid, self.listed, self.tags, self.free) {
            (_, false, _, false) => "gather_deferred, grid",
            (false, true, false, _) => "gather_deferred, listed",
            (false, true, true, _) => "gather_deferred, listed with tags",
            (true, true, false, false) => "gather_deferred, moving",
            (true, true, true, false) => "gather_deferred, moving with tags",
            (_, false, _, true) => "gather_deferred, grid with free probes",
            (true, true, false, true) => "gather_deferred, moving with free probes",
            (true, true, true, true) => "gather_deferred, moving with tags and free probes",
        }
    }
}

/// Every shader with its name.
#[must_use]
pub fn all() -> Vec<(&'static str, String)> {
    let mut all = vec![
        ("form_factor_cases", form_factor_cases()),
        ("form_factor_sums", form_factor_sums()),
        ("shadow", shadow()),
        ("direct", direct()),
        ("inject", inject()),
        ("refresh", refresh()),
        ("refresh_free", refresh_free()),
        ("gather_static", gather_static()),
        ("gather_free", gather_free()),
    ];
    all.extend(Gathering::ALL.map(|gathering| (gathering.name(), gathering.deferred(true, false))));
    all
}
