//! The times of the last frames, pass by pass, as a small plot.

use std::collections::VecDeque;

use egui::{Color32, Pos2, Sense, Stroke, Ui, Vec2};
use vlm_runtime::view::PassTimes;

/// Frames that the plot shows.
const FRAMES: usize = 120;

/// Points.
const HEIGHT: f32 = 70.0;

const COLORS: [Color32; 6] = [
    Color32::from_rgb(240, 240, 240),
    Color32::from_rgb(255, 170, 60),
    Color32::from_rgb(90, 170, 255),
    Color32::from_rgb(110, 220, 110),
    Color32::from_rgb(240, 110, 160),
    Color32::from_rgb(200, 160, 255),
];

/// The times of the last frames, milliseconds.
#[derive(Default)]
pub struct Plot {
    frames: VecDeque<PassTimes>,
}

impl Plot {
    /// Adds a frame: all of it by the clock, then its passes.
    pub fn add(&mut self, frame: f32, passes: &[(&'static str, f32)]) {
        let mut times = vec![("frame", frame)];
        times.extend(passes);
        self.frames.push_back(times);
        if self.frames.len() > FRAMES {
            self.frames.pop_front();
        }
    }

    /// Shows a line for the frame and one for each pass, and what the last frame took.
    pub fn show(&self, ui: &mut Ui) {
        let (response, painter) =
            ui.allocate_painter(Vec2::new(ui.available_width(), HEIGHT), Sense::hover());
        let rect = response.rect;
        painter.rect_filled(rect, 2.0, Color32::from_black_alpha(120));
        let most = self.frames.iter().flatten().map(|(_, time)| *time).fold(1.0, f32::max);
        let names = self.names();
        for (name, color) in names.iter().zip(COLORS.iter().cycle()) {
            let place = |(i, frame): (usize, &PassTimes)| {
                let (_, time) = frame.iter().find(|(known, _)| known == name)?;
                let x = rect.left() + rect.width() * i as f32 / (FRAMES - 1) as f32;
                Some(Pos2::new(x, rect.bottom() - rect.height() * time / most))
            };
            let line: Vec<Pos2> = self.frames.iter().enumerate().filter_map(place).collect();
            painter.line(line, Stroke::new(1.0, *color));
        }
        ui.horizontal_wrapped(|ui| {
            let last = |name| self.frames.back()?.iter().find(|(known, _)| *known == name).copied();
            for (name, color) in names.iter().zip(COLORS.iter().cycle()) {
                if let Some((name, time)) = last(*name) {
                    ui.colored_label(*color, format!("{name} {time:.1}"));
                }
            }
            ui.weak(format!("ms; top {most:.0}"));
        });
    }

    fn names(&self) -> Vec<&'static str> {
        let mut names = Vec::new();
        for (name, _) in self.frames.iter().flatten() {
            if !names.contains(name) {
                names.push(*name);
            }
        }
        names
    }
}
