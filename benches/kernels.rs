//! Kernels of a trial, each with its operations or bytes in a second, and a touch of the bird.

#[path = "common/pieces/mod.rs"]
#[allow(dead_code)]
mod pieces;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Point3, UnitVector3, Vector3};
use palpate::sim::environment::ObjectShape;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;

fn pieces_of_a_trial(c: &mut Criterion) {
    for mut piece in pieces::pieces() {
        let mut group = c.benchmark_group("trial");
        if piece.flops > 0.0 {
            group.throughput(Throughput::Elements(piece.flops as u64));
        } else if piece.bytes > 0.0 {
            group.throughput(Throughput::Bytes(piece.bytes as u64));
        }
        group.bench_function(piece.name.clone(), |b| b.iter(|| (piece.run)()));
        group.finish();
    }
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
    if let ObjectShape::Mesh { bvh, .. } = environment.shape() {
        let origin = Point3::new(0.013, -0.5, 0.487);
        let direction = UnitVector3::new_unchecked(-Vector3::y());
        group.bench_function("ray", |b| b.iter(|| bvh.ray(black_box(&origin), &direction, 1.0)));
    }
    group.finish();
}

criterion_group!(benches, pieces_of_a_trial, contact);
criterion_main!(benches);
