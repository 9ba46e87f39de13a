//! A fragment shader that calls the runtime's module finds what the deferred gather finds.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;

use glam::{Vec3, Vec4};
use vlm_bake::bake::bake;
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::scene::{LoadOptions, load};
use vlm_bake::shade::{SurfacePoint, TraceScene};
use vlm_format::GltfFile;
use vlm_runtime::{Frame, IrradianceFormat, Settings, VlmAsset};
use vlm_tests::runtime_gpu::{Host, view};
use wgpu::{BindGroup, BindGroupLayout, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor};

const SIZE: u32 = 32;

/// Of a pixel over the frame's mean: positions come by another way.
const BOUND: f32 = 1e-4;

/// A picture that reads its surface from textures, in group 0.
const SURFACE: &str = "
@group(0) @binding(0) var surface_positions: texture_2d<f32>;
@group(0) @binding(1) var surface_normals: texture_2d<f32>;
@vertex
fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(vec2u(i & 1u, i >> 1u)) * 4.0 - 1.0, 0.5, 1.0);
}
@fragment
fn fragment(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let position = textureLoad(surface_positions, vec2u(pixel.xy), 0);
    let normal = textureLoad(surface_normals, vec2u(pixel.xy), 0).xyz;
    if position.w == 0.0 {
        return vec4f(0.0);
    }
    return vec4f(indirect(position.xyz, normal, normal, 0u).irradiance, 1.0);
}
";

/// Positions and normals of a picture as group 0.
fn surface(host: &Host, gbuffer: &GBuffer) -> (BindGroupLayout, BindGroup) {
    let of = |value: fn(&SurfacePoint) -> Vec4| -> TextureView {
        let texels: Vec<Vec4> =
            gbuffer.points.iter().map(|point| point.as_ref().map_or(Vec4::ZERO, value)).collect();
        host.texture([SIZE, SIZE], TextureFormat::Rgba32Float, bytemuck::cast_slice(&texels))
    };
    let views = [of(|p| p.position.extend(1.0)), of(|p| p.normal.extend(0.0))];
    let entries = [0, 1].map(|binding| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty: wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        count: None,
    });
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries };
    let layout = host.device.create_bind_group_layout(&descriptor);
    let entry = |(binding, view)| wgpu::BindGroupEntry {
        binding,
        resource: wgpu::BindingResource::TextureView(view),
    };
    let entries: Vec<_> = (0..).zip(&views).map(entry).collect();
    let descriptor = wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries };
    let group = host.device.create_bind_group(&descriptor);
    (layout, group)
}

fn pipeline(host: &Host, surface: &BindGroupLayout) -> wgpu::RenderPipeline {
    let source = host.renderer.forward_module(1).unwrap() + SURFACE;
    let module = host.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let [common, scene] = host.renderer.forward_layouts().unwrap();
    let layout = host.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(surface), Some(common), Some(scene)],
        immediate_size: 0,
    });
    host.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(TextureFormat::Rgba32Float.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// One frame by a fragment shader, lx.
fn forward(host: &mut Host, gbuffer: &GBuffer, frame: &Frame) -> Vec<Vec3> {
    let (layout, surface) = surface(host, gbuffer);
    let pipeline = pipeline(host, &layout);
    let mut encoder = host.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    host.renderer.prepare(&host.queue, frame).unwrap();
    let stats = host.renderer.record_light(&mut encoder).unwrap();
    assert!(!stats.passes.contains(&"gather"), "{stats:?}");
    let picture = host.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIZE, height: SIZE, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: TextureFormat::Rgba32Float,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = picture.create_view(&TextureViewDescriptor::default());
    let attachment = wgpu::RenderPassColorAttachment {
        view: &view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations::default(),
    };
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(attachment)],
        ..wgpu::RenderPassDescriptor::default()
    });
    let [common, scene] = host.renderer.forward_groups().unwrap();
    pass.set_pipeline(&pipeline);
    (0..).zip([&surface, common, scene]).for_each(|(number, group)| pass.set_bind_group(number, group, &[]));
    pass.draw(0..3, 0..1);
    drop(pass);
    host.queue.submit([encoder.finish()]);
    host.read(&picture).unwrap()
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn by_the_grid_and_by_a_list() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb");
    let file = GltfFile::open(&path).unwrap();
    let scene = load(&file, &LoadOptions::default()).unwrap();
    let options = BakeOptions::preset(Preset::Draft, scene.triangles.len());
    let asset = VlmAsset::new(bake(&scene, &options, &Silent).unwrap().asset, file.world_from_nodes());
    let trace = TraceScene::new(&scene);
    let camera = &scene.cameras[0];
    let gbuffer = GBuffer::trace(&trace, camera, SIZE, SIZE);
    for fewest_lights_for_grid in [0, u32::MAX] {
        let format = IrradianceFormat::Float;
        let settings = Settings { fewest_lights_for_grid, format, ..Settings::default() };
        let mut host = Host::new(&asset, settings).unwrap();
        let frame = Frame { lights: &trace.lights, view: view(camera, &gbuffer, 1.0), ..Frame::default() };
        let found = forward(&mut host, &gbuffer, &frame);
        let pictures = host.upload(&gbuffer, camera, |_| 0);
        let (expected, stats) = host.frame(&frame, &pictures).unwrap();
        assert_eq!(stats.passes, ["gather"], "what the forward frame found is kept");
        let mean = expected.iter().map(|e| e.element_sum() / 3.0).sum::<f32>() / expected.len() as f32;
        let apart = |a: &[Vec3]| {
            let differs = |(a, b): &(&Vec3, &Vec3)| (**a - **b).abs().max_element() > BOUND * mean;
            a.iter().zip(&expected).filter(differs).count()
        };
        assert!(mean > 0.0 && apart(&found) * 100 < found.len(), "{} apart", apart(&found));
        let brighter: Vec<Vec3> = found.iter().map(|e| *e * 1.001).collect();
        assert!(apart(&brighter) * 2 > found.len(), "the check can fail");
    }
}
