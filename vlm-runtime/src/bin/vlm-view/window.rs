//! The window: winit's events in, frames out.

use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{CentralPanel, Panel, Sense};
use vlm_bake::follow::FollowOptions;
use vlm_runtime::view::{
    Arguments, Controls, Look, OpenOptions, Screen, Session, Sources, ViewError, Viewer, ViewerOptions,
    WatchOptions, Watcher,
};
use winit::application::ApplicationHandler;
use winit::dpi::LogicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Window, WindowId};

use crate::flying::Flying;
use crate::panel::panel;
use crate::plot::Plot;
use crate::surface::WindowSurface;

/// Of the picture, points.
const DEFAULT_SIZE: (u32, u32) = (1024, 768);

/// Points; the picture of `--size` stands beside it.
const PANEL_WIDTH: f32 = 320.0;

/// Runs the window until it is closed.
pub fn run(arguments: Arguments) -> Result<(), ViewError> {
    if arguments.file.as_os_str() == "-" {
        return Err(ViewError::Usage(
            "standard input cannot be followed: name a file, or use `--headless`".to_owned(),
        ));
    }
    let failed = |error: winit::error::EventLoopError| ViewError::Window(error.to_string());
    let event_loop = EventLoop::with_user_event().build().map_err(failed)?;
    let mut app = App { arguments, proxy: event_loop.create_proxy(), open: None, failure: None };
    event_loop.run_app(&mut app).map_err(failed)?;
    app.failure.map_or(Ok(()), Err)
}

/// What winit drives.
struct App {
    arguments: Arguments,
    proxy: EventLoopProxy<()>,
    open: Option<Open>,
    failure: Option<ViewError>,
}

/// An open window.
struct Open {
    window: Arc<Window>,
    surface: WindowSurface,
    session: Session,
    input: egui_winit::State,
    plot: Plot,
    /// Of the last frame that had anything to do.
    milliseconds: f32,
    flying: Flying,
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.open.is_none() {
            match Open::new(&self.arguments, self.proxy.clone(), event_loop) {
                Ok(open) => self.open = Some(open),
                Err(error) => {
                    self.failure = Some(error);
                    event_loop.exit();
                }
            }
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, (): ()) {
        if let Some(open) = &self.open {
            open.window.request_redraw();
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.open else { return };
        if open.input.on_window_event(&open.window, &event).repaint {
            open.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => {
                open.surface.resize(size.width, size.height);
                open.window.request_redraw();
            }
            WindowEvent::RedrawRequested => match open.draw() {
                None => event_loop.set_control_flow(ControlFlow::Wait),
                Some(Duration::ZERO) => open.window.request_redraw(),
                Some(soon) => event_loop.set_control_flow(ControlFlow::WaitUntil(Instant::now() + soon)),
            },
            _ => {}
        }
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // The surface goes before the connection to the display.
        self.open = None;
    }

    fn new_events(&mut self, _: &ActiveEventLoop, cause: winit::event::StartCause) {
        if let (winit::event::StartCause::ResumeTimeReached { .. }, Some(open)) = (cause, &self.open) {
            open.window.request_redraw();
        }
    }
}

impl Open {
    fn new(
        arguments: &Arguments,
        proxy: EventLoopProxy<()>,
        event_loop: &ActiveEventLoop,
    ) -> Result<Self, ViewError> {
        let (width, height) = arguments.size.unwrap_or(DEFAULT_SIZE);
        let title = format!("{} - vlm-view", arguments.file.display());
        let size = LogicalSize::new(f64::from(width) + f64::from(PANEL_WIDTH), f64::from(height));
        let attributes = Window::default_attributes().with_title(title).with_inner_size(size);
        let window = event_loop.create_window(attributes);
        let window = Arc::new(window.map_err(|error| ViewError::Window(error.to_string()))?);
        let surface = WindowSurface::new(&window, event_loop.owned_display_handle())?;
        let session = session(arguments, &surface, proxy)?;
        let context = egui::Context::default();
        context.set_theme(egui::Theme::Dark);
        let side = surface.gpu.device.limits().max_texture_dimension_2d as usize;
        let viewport = egui::ViewportId::ROOT;
        let input = egui_winit::State::new(context, viewport, event_loop, None, None, Some(side));
        window.request_redraw();
        let (plot, flying) = (Plot::default(), Flying::new());
        Ok(Self { window, surface, session, input, plot, milliseconds: 0.0, flying })
    }

    /// Draws a frame; when the next one is due, if at all.
    fn draw(&mut self) -> Option<Duration> {
        let start = Instant::now();
        self.session.take_news();
        let input = self.input.take_egui_input(&self.window);
        let context = self.input.egui_ctx().clone();
        let (mut picture, mut is_moving) = (egui::Rect::NOTHING, false);
        let (session, plot, flying) = (&mut self.session, &self.plot, &mut self.flying);
        let mut output = context.run_ui(input, |ui| {
            Panel::left("panel")
                .exact_size(PANEL_WIDTH)
                .resizable(false)
                .show(ui, |ui| panel(ui, session, plot));
            CentralPanel::no_frame().show(ui, |ui| {
                picture = ui.max_rect();
                let response = ui.interact(picture, ui.scope_id().with("picture"), Sense::click_and_drag());
                is_moving = flying.take(ui, &response, session);
            });
        });
        self.input.handle_platform_output(&self.window, std::mem::take(&mut output.platform_output));
        let repaint = output.viewport_output.values().map(|viewport| viewport.repaint_delay).min();

        let freed = self.surface.take_textures(&mut output);
        let Some(texture) = self.surface.next() else {
            self.surface.free_textures(&freed);
            return Some(Duration::from_millis(50));
        };
        let view = texture.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let has_picture = self.show_picture(&view, picture, output.pixels_per_point);
        self.surface.paint(&view, (&context, output), !has_picture);
        self.surface.free_textures(&freed);
        self.window.pre_present_notify();
        self.surface.gpu.queue.present(texture);
        self.time(start);

        let is_busy = is_moving || self.session.report().is_pending;
        let soon = if is_busy { Some(Duration::ZERO) } else { None };
        let while_opening = self.session.activity().map(|_| Duration::from_millis(100));
        let repaint = repaint.filter(|delay| *delay < Duration::from_secs(3600));
        [soon, repaint, while_opening].into_iter().flatten().min()
    }

    /// Adds frames that had anything to do to the plot, with the times of their passes where the device tells them.
    fn time(&mut self, start: Instant) {
        if self.session.has_worked() {
            self.milliseconds = start.elapsed().as_secs_f32() * 1e3;
            if !self.surface.gpu.has_timestamps {
                self.plot.add(self.milliseconds, &[]);
            }
        }
        if let Some(times) = self.session.take_times() {
            self.plot.add(self.milliseconds, &times);
        }
    }

    /// Shows the picture beside the panel; true if there is one.
    fn show_picture(&mut self, view: &wgpu::TextureView, rect: egui::Rect, scale: f32) -> bool {
        let [width, height] = self.surface.size();
        let pixel = |points: f32, most: u32| ((points * scale).round().max(0.0) as u32).min(most);
        let origin = [pixel(rect.left(), width), pixel(rect.top(), height)];
        let end = [pixel(rect.right(), width), pixel(rect.bottom(), height)];
        let size = [0, 1].map(|axis| end[axis].saturating_sub(origin[axis]));
        if size.contains(&0) || !self.session.frame(size, false) {
            return false;
        }
        self.session.present(Screen { view, origin })
    }
}

fn session(
    arguments: &Arguments,
    surface: &WindowSurface,
    proxy: EventLoopProxy<()>,
) -> Result<Session, ViewError> {
    let sources = Sources::for_this_build();
    let options = WatchOptions {
        file: arguments.file.clone(),
        open: OpenOptions { preset: arguments.preset, needs_lights: true },
        shaders: sources.files(),
        follow: FollowOptions::default(),
    };
    let viewer_options =
        ViewerOptions { format: surface.format(), shadows: arguments.shadows, measures: false };
    let viewer = Viewer::new(surface.gpu.clone(), sources, viewer_options)?;
    // The window may be gone while the file is still being opened.
    let wake = move || proxy.send_event(()).unwrap_or_default();
    let watcher = Watcher::start(options, Arc::new(wake))?;
    let controls = Controls {
        method: arguments.method.into(),
        exposure: arguments.exposure.unwrap_or(1.0),
        overlays: arguments.overlay[..].into(),
        alpha_masks: arguments.alpha_masks,
        ..Controls::default()
    };
    let mut session = Session::new(viewer, watcher, controls);
    session.look = Look::Camera(arguments.camera.clone());
    session.wants_exposure = arguments.exposure.is_none();
    Ok(session)
}
