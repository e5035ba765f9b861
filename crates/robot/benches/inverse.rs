//! Poses a second and core: all ways of the closed forms, checked from the returned angles.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_data::robots;
use meltpath_numerics::random::Random;
use meltpath_robot::cell;

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
        let poses: Vec<_> = (0..COUNT)
            .map(|_| arm.forward(std::array::from_fn(|_| random.between(-3.1, 3.1))))
            .collect();
        group.bench_function(file.name, |b| {
            b.iter(|| poses.iter().filter(|p| arm.inverse(**p).is_ok()).count());
        });
    }
    group.finish();
}

criterion_group!(benches, inverse);
criterion_main!(benches);
