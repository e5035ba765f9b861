//! Poses a second and core: all ways of the closed forms, checked from the returned angles; one by one, and many at once.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_data::robots;
use meltpath_geometry::Pose;
use meltpath_numerics::random::Random;
use meltpath_robot::cell;
use meltpath_robot::kinematics::{Batch, Poses, Ways};

const COUNT: u32 = 10_000;

fn inverse(c: &mut Criterion) {
    let mut group = c.benchmark_group("inverse");
    group.throughput(Throughput::Elements(u64::from(COUNT)));
    for file in [
        robots::FANUC_ARCMATE_120IC,
        robots::STAUBLI_RX60BL,
        robots::UNIVERSAL_UR10E,
    ] {
        let Ok(cell) = cell::read(file.text) else {
            continue;
        };
        let mut random = Random::new(1);
        let arm = cell.arm;
        let poses: Vec<Pose> = (0..COUNT)
            .map(|_| arm.forward(std::array::from_fn(|_| random.between(-3.1, 3.1))))
            .collect();
        group.bench_function(format!("one by one/{}", file.name), |b| {
            b.iter(|| poses.iter().filter(|p| arm.inverse(**p).is_ok()).count());
        });
        let poses: Poses = poses.into_iter().collect();
        let batch = Batch::of(&arm);
        let mut ways = Ways::default();
        group.bench_function(format!("at once/{}", file.name), |b| {
            b.iter(|| {
                batch.inverse(&poses, &mut ways);
                ways.angles()[0].len()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, inverse);
criterion_main!(benches);
