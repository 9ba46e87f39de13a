//! Error against distance over size, for this project's form and for the textbook's, on the CPU and on the GPU.

use std::error::Error;
use std::path::Path;

use super::bins::Errors;
use super::case::Case;
use super::command::on_cpu;
use super::generate::{Kind, generate};
use super::gpu::GpuFormFactor;
use super::reference::truth;
use super::stress::BATCH;
use super::textbook::{EdgeForm, textbook};
use crate::plot::{Axis, Curve, Figure, Point};

/// Bins per decade of distance.
const PER_DECADE: f64 = 2.0;
/// Lowest and highest power of ten of distance over size.
const DECADES: (f64, f64) = (-3.0, 4.0);
/// The most cases: the figure needs enough for a 99th percentile, not for a tail.
const MOST_CASES: u64 = 2_000_000;

/// What a figure compares: cases in, form factors out.
type Form<'a> = (String, usize, Box<dyn Fn(&[Case]) -> Vec<f32> + 'a>);

/// Draws `path`.svg and `path`.png over at most `count` cases. Without a GPU the figure has the CPU's curves alone.
///
/// # Errors
/// If the figure cannot be written.
pub fn plot(count: u64, path: &Path) -> Result<(), Box<dyn Error>> {
    let gpu = GpuFormFactor::new().and_then(|ours| Ok((ours, GpuFormFactor::textbook()?)));
    let mut forms: Vec<Form<'_>> = vec![("this project, CPU".to_owned(), 0, Box::new(on_cpu))];
    for (series, (name, form)) in (1..).zip(TEXTBOOK) {
        let by_form = move |cases: &[Case]| cases.iter().map(|case| textbook(form, case)).collect();
        forms.push((format!("{name}, CPU"), series, Box::new(by_form)));
    }
    let mut device = "no GPU".to_owned();
    match &gpu {
        Ok((ours, theirs)) => {
            device.clone_from(&ours.name);
            let failed = |cases: &[Case]| vec![f32::NAN; cases.len()];
            let by_gpu = move |cases: &[Case]| ours.evaluate(cases).unwrap_or_else(|_| failed(cases));
            forms.push(("this project, GPU".to_owned(), 4, Box::new(by_gpu)));
            for (series, (name, form)) in (5..).zip(TEXTBOOK) {
                let by_form = move |cases: &[Case]| {
                    theirs.evaluate_textbook(form, cases).unwrap_or_else(|_| failed(cases))
                };
                forms.push((format!("{name}, GPU"), series, Box::new(by_form)));
            }
        }
        Err(error) => eprintln!("the figure has no GPU: {error}"),
    }
    let count = count.min(MOST_CASES);
    let curves = errors_by_distance(count, &forms)
        .iter()
        .zip(&forms)
        .map(|(bins, (name, series, _))| Curve::new(name, *series, points(bins)))
        .collect();
    let figure = Figure {
        title: "Error of the form factor in single precision".to_owned(),
        subtitle: format!(
            "99th percentile over {count} generated cases, aspect ratio up to 100, whole light above the horizon; GPU: {device}"
        ),
        x: Axis::log("distance / size of the light"),
        y: Axis::log("error / uncosined form factor U"),
        curves,
    };
    Ok(figure.write(path)?)
}

const TEXTBOOK: [(&str, EdgeForm); 3] =
    [("acos", EdgeForm::Acos), ("atan2", EdgeForm::Atan2), ("LTC fit", EdgeForm::LtcFit)];

/// For each form, the errors of each bin of distance.
fn errors_by_distance(count: u64, forms: &[Form<'_>]) -> Vec<Vec<Errors>> {
    let bins = ((DECADES.1 - DECADES.0) * PER_DECADE) as usize;
    let mut all = vec![vec![Errors::default(); bins]; forms.len()];
    for first in (0..count).step_by(BATCH as usize) {
        let cases: Vec<Case> = (first..(first + BATCH).min(count))
            .map(generate)
            .filter(is_shown)
            .map(|(_, case)| case)
            .collect();
        let truths: Vec<_> = cases.iter().map(|case| truth(case).zip(bin_of(case))).collect();
        for (errors, (_, _, form)) in all.iter_mut().zip(forms) {
            for (i, (result, truth)) in form(&cases).iter().zip(&truths).enumerate() {
                let Some((truth, bin)) = truth.filter(|(t, _)| t.uncosined > 0.0 && !t.crosses) else {
                    continue;
                };
                let error = (f64::from(*result) - truth.form_factor).abs() / truth.uncosined;
                errors[bin].add(error, first + i as u64);
            }
        }
    }
    all
}

fn is_shown((kind, case): &(Kind, Case)) -> bool {
    *kind == Kind::Anywhere && case.aspect() <= 100.0
}

fn bin_of(case: &Case) -> Option<usize> {
    let decade = (case.distance() / case.size()).log10();
    (decade >= DECADES.0 && decade < DECADES.1).then_some(((decade - DECADES.0) * PER_DECADE) as usize)
}

fn points(bins: &[Errors]) -> Vec<Point> {
    let at = |bin: usize| 10f64.powf(DECADES.0 + (bin as f64 + 0.5) / PER_DECADE);
    let filled = bins.iter().enumerate().filter(|(_, errors)| errors.count > 0);
    filled.map(|(bin, errors)| Point::new(at(bin), errors.quantile(0.99))).collect()
}
