//! What one trial spends its time on, piece by piece.

use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};
use nalgebra::{Point3, UnitVector3, Vector3};
use palpate::gp::likelihood::Likelihood;
use palpate::gp::posterior::Scratch;
use palpate::gp::{Mean, Posterior};
use palpate::sim::environment::Shape;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use palpate::study::bench::product;
use palpate::study::bench::sample::{KERNEL, hyperparameters, search_box, touches};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;

fn gaussian_process(c: &mut Criterion) {
    let bounds = search_box();
    let mut group = c.benchmark_group("gp");
    for count in [20, 50, 200] {
        group.bench_with_input(
            BenchmarkId::new("cold fit", count),
            &touches(count),
            |b, touches| {
                b.iter(|| bounds.fit(&KERNEL, black_box(touches)));
            },
        );
    }
    // What the likelihood's n³ operations are held against.
    let mut product = product();
    group.bench_function(product.name.clone(), |b| b.iter(|| (product.run)()));
    for count in [50, 100, 200, 1000] {
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
    let Some(environment) =
        Scene::load(&path, &[]).ok().and_then(|scene| Environment::build(scene).ok())
    else {
        return;
    };
    let environment = Arc::new(environment);
    let simulator = Simulator::new(Arc::clone(&environment)).ok();
    let Some(mut probe) = simulator.and_then(|simulator| simulator.probe(0).ok()) else {
        return;
    };
    let approach = environment.task().approach(&[0.013, 0.487].into()).unwrap();
    group.bench_function("touch", |b| b.iter(|| probe.touch(black_box(&approach))));
    if let Shape::Mesh { bvh, .. } = environment.shape() {
        let origin = Point3::new(0.013, -0.5, 0.487);
        let direction = UnitVector3::new_unchecked(-Vector3::y());
        group.bench_function("ray", |b| b.iter(|| bvh.ray(black_box(&origin), &direction, 1.0)));
    }
    group.finish();
}

criterion_group!(benches, gaussian_process, contact);
criterion_main!(benches);
