//! The panel: what the user may choose, and what there is to know.

use egui::{Color32, ComboBox, DragValue, RichText, ScrollArea, Slider, Ui};
use glam::Vec3;
use vlm_bake::render::Method;
use vlm_runtime::view::{BounceControl, Controls, Flight, LightControl, Look, Session};

use crate::plot::Plot;

const METHODS: [Method; 3] = [Method::Vlm, Method::Brute, Method::Direct];

/// Shows the panel.
pub fn panel(ui: &mut Ui, session: &mut Session, plot: &Plot) {
    state(ui, session);
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        ui.spacing_mut().slider_width = 130.0;
        look(ui, session);
        method(ui, &mut session.controls);
        exposure(ui, session);
        section(ui, "Bounced light", true, |ui| bounces(ui, &mut session.controls.bounces));
        section(ui, "Lights", true, |ui| lights(ui, &mut session.controls.lights));
        section(ui, "Overlays", true, |ui| overlays(ui, &mut session.controls));
        section(ui, "Time", true, |ui| plot.show(ui));
        section(ui, "Counts", false, |ui| counts(ui, session));
        if !session.notes().is_empty() {
            section(ui, "Notes", false, |ui| {
                session.notes().iter().for_each(|note| {
                    ui.label(note);
                });
            });
        }
    });
}

fn section(ui: &mut Ui, title: &str, open: bool, contents: impl FnOnce(&mut Ui)) {
    egui::CollapsingHeader::new(RichText::new(title).strong()).default_open(open).show(ui, contents);
}

/// The file, what is being done to it, and why it is not shown as it is now.
fn state(ui: &mut Ui, session: &Session) {
    ui.strong(session.name());
    if session.is_baked() {
        ui.weak("has no Virtual Light Mesh: baked for this view only");
    }
    if let Some((stage, done)) = session.activity() {
        ui.add(egui::ProgressBar::new(done).text(stage));
    }
    for error in session.errors() {
        ui.colored_label(Color32::from_rgb(255, 110, 90), error);
    }
    if session.errors().next().is_some() && session.opened() > 0 {
        ui.weak("shown: the last version without an error");
    }
    ui.separator();
}

fn look(ui: &mut Ui, session: &mut Session) {
    let names: Vec<String> = session.viewer.scene().map_or_else(Vec::new, |scene| {
        scene.cameras_or_default().iter().map(|camera| camera.name.clone()).collect()
    });
    let chosen = match &session.look {
        Look::Flight(_) => "flying".to_owned(),
        Look::Camera(_) => session.camera().map_or_else(String::new, |camera| camera.name),
    };
    ComboBox::from_label("camera").selected_text(chosen).show_ui(ui, |ui| {
        for (number, name) in names.into_iter().enumerate() {
            // By number, since names may repeat.
            ui.selectable_value(&mut session.look, Look::Camera(Some(number.to_string())), name);
        }
        let flight = session.camera().map(|camera| Flight::from_camera(&camera));
        if let Some(flight) = flight
            && ui.selectable_label(matches!(session.look, Look::Flight(_)), "fly").clicked()
        {
            session.look = Look::Flight(flight);
        }
    });
    ui.weak("drag to look, W A S D Q E to fly, wheel for speed");
}

fn method(ui: &mut Ui, controls: &mut Controls) {
    ComboBox::from_label("indirect light").selected_text(controls.method.name()).show_ui(ui, |ui| {
        for method in METHODS {
            ui.selectable_value(&mut controls.method, method, method.name());
        }
    });
    let compared = controls.compared.map_or("off", Method::name);
    ComboBox::from_label("difference to").selected_text(compared).show_ui(ui, |ui| {
        ui.selectable_value(&mut controls.compared, None, "off");
        for method in METHODS {
            ui.selectable_value(&mut controls.compared, Some(method), method.name());
        }
    });
    if controls.compared.is_some() {
        ui.add(Slider::new(&mut controls.difference_gain, 0.1..=1000.0).logarithmic(true).text("gain"));
        ui.weak("orange: the first is brighter; blue: the second");
    }
}

fn exposure(ui: &mut Ui, session: &mut Session) {
    ui.horizontal(|ui| {
        let exposure = &mut session.controls.exposure;
        ui.add(Slider::new(exposure, 1e-6..=1e3).logarithmic(true).text("exposure"));
        session.wants_exposure |= ui.button("auto").clicked();
    });
    ui.add(Slider::new(&mut session.controls.direct_share, 0.0..=1.0).text("direct share"));
    ui.add(Slider::new(&mut session.controls.indirect_share, 0.0..=4.0).text("indirect share"));
}

/// The artist's part: how strongly, and in which colour, each piece of surface sends light on.
fn bounces(ui: &mut Ui, bounces: &mut [BounceControl]) {
    if bounces.is_empty() {
        ui.weak("there are no virtual lights");
    }
    for (number, bounce) in bounces.iter_mut().enumerate() {
        ui.push_id(number, |ui| {
            ui.horizontal(|ui| {
                let mut color = bounce.color().to_array();
                // The picker rounds, which is no choice of the user's.
                if ui.color_edit_button_rgb(&mut color).changed()
                    && bounce.color().distance(Vec3::from_array(color)) > 1e-3
                {
                    bounce.set_color(Vec3::from_array(color));
                }
                ui.add(DragValue::new(&mut bounce.intensity).range(0.0..=1000.0).speed(0.02).prefix("x "));
                if !bounce.is_neutral() && ui.small_button("reset").clicked() {
                    (bounce.intensity, bounce.tint) = (1.0, Vec3::ONE);
                }
                let lights = format!("{} virtual lights", bounce.group.lights.len());
                ui.label(&bounce.group.name).on_hover_text(lights);
            });
            if !bounce.is_neutral() && bounce.group.is_whole {
                // To be kept, it goes into the file.
                let mut extras = bounce.as_extras();
                ui.add(egui::TextEdit::singleline(&mut extras).desired_width(f32::INFINITY))
                    .on_hover_text("extras of the node: copy it into the file to keep this");
            }
        });
    }
}

fn lights(ui: &mut Ui, lights: &mut [LightControl]) {
    if lights.is_empty() {
        ui.weak("only surfaces shine here");
    }
    for (number, light) in lights.iter_mut().enumerate() {
        ui.push_id(number, |ui| {
            ui.horizontal(|ui| {
                ui.label(format!("{} {number}", kind(light)));
                let unit = if light.original.directional { "lx" } else { "cd" };
                let full = light.light.intensity.max_element();
                ui.weak(format!("{:.4} {unit}", full * light.intensity));
                if *light != untouched(light) && ui.small_button("reset").clicked() {
                    *light = untouched(light);
                }
            });
            ui.add(Slider::new(&mut light.intensity, 0.0..=10.0).text("intensity"));
            color(ui, light);
            if light.original.directional || has_cone(light) {
                direction(ui, &mut light.light.direction);
            }
            if !light.original.directional {
                ui.horizontal(|ui| {
                    let Vec3 { x, y, z } = &mut light.light.position;
                    for coordinate in [x, y, z] {
                        ui.add(DragValue::new(coordinate).speed(0.02).suffix(" m"));
                    }
                });
            }
        });
    }
}

/// The light's colour at its own brightness.
fn color(ui: &mut Ui, light: &mut LightControl) {
    let most = light.light.intensity.max_element().max(f32::MIN_POSITIVE);
    let mut rgb = (light.light.intensity / most).to_array();
    ui.horizontal(|ui| {
        if ui.color_edit_button_rgb(&mut rgb).changed() {
            light.light.intensity =
                Vec3::from_array(rgb).max(Vec3::splat(1e-4)) * light.original.intensity.max_element();
        }
        ui.weak("colour");
    });
}

/// Around the vertical, and down.
fn direction(ui: &mut Ui, direction: &mut Vec3) {
    let mut around = direction.x.atan2(direction.z);
    let mut down = (-direction.y).clamp(-1.0, 1.0).asin();
    ui.horizontal(|ui| {
        let turned = ui.drag_angle(&mut around).changed();
        ui.weak("around");
        let tilted = ui.drag_angle(&mut down).changed();
        ui.weak("down");
        if turned || tilted {
            let down = down.clamp(-1.5, 1.5);
            let level = down.cos();
            *direction = Vec3::new(around.sin() * level, -down.sin(), around.cos() * level);
        }
    });
}

fn kind(light: &LightControl) -> &'static str {
    match (light.original.directional, has_cone(light)) {
        (true, _) => "sun",
        (false, true) => "spot",
        (false, false) => "point",
    }
}

fn has_cone(light: &LightControl) -> bool {
    light.original.cone_scale != 0.0
}

fn untouched(light: &LightControl) -> LightControl {
    LightControl { original: light.original, light: light.original, intensity: 1.0 }
}

fn overlays(ui: &mut Ui, controls: &mut Controls) {
    let overlays = &mut controls.overlays;
    ui.checkbox(&mut overlays.wireframe, "virtual lights by clearance");
    if overlays.wireframe {
        ui.weak("red: less than required; yellow: just; green: up to ten times that; blue: deeper");
    }
    ui.checkbox(&mut overlays.radiosity, "injected radiosity");
    ui.checkbox(&mut overlays.tags, "tags");
    ui.checkbox(&mut overlays.cells, "cells by near lights");
    if overlays.cells {
        ui.weak("blue: few; green, yellow, red: most; black: no cell");
    }
}

fn counts(ui: &mut Ui, session: &Session) {
    let stats = &session.report().stats;
    let skipped = stats.lights_skipped;
    let rows = [
        ("adapter", session.viewer.gpu().name.clone()),
        ("opened", session.opened().to_string()),
        ("passes", stats.passes.join(", ")),
        ("lights", stats.lights.to_string()),
        ("injected", stats.lights_injected.to_string()),
        ("skipped", format!("{} unchanged, {} black", skipped.unchanged, skipped.black)),
        ("uploaded", format!("{} bytes", stats.bytes_uploaded)),
    ];
    egui::Grid::new("counts").show(ui, |ui| {
        for (name, value) in rows {
            ui.weak(name);
            ui.label(value);
            ui.end_row();
        }
    });
}
