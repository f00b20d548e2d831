//! What one trial spends its time on, piece by piece.

use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};
use nalgebra::{Point3, UnitVector3, Vector3};
use palpate::conduct::probe;
use palpate::ground::gp::fit::SearchBox;
use palpate::ground::gp::kernel::{Hyperparameters, SquaredExponential};
use palpate::ground::gp::likelihood::Likelihood;
use palpate::ground::gp::posterior::Scratch;
use palpate::ground::gp::{Mean, Observations, Posterior};
use palpate::world::world::Shape;
use palpate::world::{Scene, World};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;

static KERNEL: SquaredExponential = SquaredExponential;

/// `count` touches of a smooth surface over a unit square, spread by a low-discrepancy walk.
fn touches(count: usize) -> Observations {
    let mut touches = Observations::new(2);
    for i in 0..count {
        let place = [(i as f64 * 0.754_877_666) % 1.0, (i as f64 * 0.569_840_291) % 1.0];
        touches.push(&place, (7.0 * place[0]).sin() + (4.0 * place[1]).cos());
    }
    touches
}

fn hyperparameters() -> Hyperparameters {
    Hyperparameters { signal_sd: 1.0, length_scales: vec![0.2, 0.4], noise_sd: 1e-3, mean: 0.0 }
}

fn gaussian_process(c: &mut Criterion) {
    let bounds = SearchBox {
        mean: Mean::Zero,
        length_scales: vec![(0.005, 1.0).into(); 2],
        noise_ratio: (1e-4, 1e-2).into(),
        signal_sd: (1e-3, 1e3).into(),
        noise_sd: None,
    };
    let mut group = c.benchmark_group("gp");
    for count in [20, 50, 200] {
        group.bench_with_input(
            BenchmarkId::new("cold fit", count),
            &touches(count),
            |b, touches| {
                b.iter(|| bounds.fit(&KERNEL, black_box(touches), None));
            },
        );
    }
    for count in [50, 200, 1000] {
        let touches = touches(count);
        let mut likelihood = Likelihood::new(&KERNEL, Mean::Zero, &touches);
        let mut gradient = [0.0; 4];
        group.bench_function(BenchmarkId::new("likelihood with gradient", count), |b| {
            b.iter(|| likelihood.value_gradient(black_box(&hyperparameters()), &mut gradient));
        });
        let touches = touches.clone();
        let Ok(posterior) = Posterior::new(&KERNEL, hyperparameters(), touches) else { continue };
        let mut scratch = Scratch::default();
        group.bench_with_input(BenchmarkId::new("variance", count), &posterior, |b, posterior| {
            b.iter(|| posterior.variance(black_box(&[0.31, 0.47]), &mut scratch));
        });
        let mut slope = [0.0; 2];
        group.bench_function(BenchmarkId::new("variance with gradient", count), |b| {
            b.iter(|| {
                posterior.variance_gradient(black_box(&[0.31, 0.47]), &mut slope, &mut scratch)
            });
        });
        group.bench_function(BenchmarkId::new("add a touch", count), |b| {
            b.iter_batched_ref(
                || posterior.clone(),
                |posterior| posterior.add(black_box(&[0.313, 0.471]), 1.0),
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

fn contact(c: &mut Criterion) {
    let mut group = c.benchmark_group("bird, 48 200 triangles");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bird.toml");
    let Some(world) = Scene::load(&path, &[]).ok().and_then(|scene| World::build(scene).ok())
    else {
        return;
    };
    let world = Arc::new(world);
    let mut probe = probe::open(&world, 0).unwrap();
    group.bench_function("touch", |b| b.iter(|| probe.touch(black_box(&[0.013, 0.487]))));
    if let Shape::Mesh { bvh, .. } = world.shape() {
        let origin = Point3::new(0.013, -0.5, 0.487);
        let direction = UnitVector3::new_unchecked(-Vector3::y());
        group.bench_function("ray", |b| b.iter(|| bvh.ray(black_box(&origin), &direction, 1.0)));
    }
    group.finish();
}

criterion_group!(benches, gaussian_process, contact);
criterion_main!(benches);
