//! Both ends of the text interface among peers that send anything in any order. Nothing panics, everything
//! stays within its bounds, no message is torn, no request ends twice.
//!
//! The fuzz targets `text_server` and `text_client` drive the same with bytes of their own.
#![cfg(feature = "sim")]

#[allow(dead_code, reason = "another suite uses the rest of it")]
#[path = "../enip_hostile/choices.rs"]
mod choices;
mod client;
mod server;

fn random(seed: u64, len: usize) -> Vec<u8> {
    let mut random = fastrand::Rng::with_seed(seed);
    std::iter::repeat_with(|| random.u8(..)).take(len).collect()
}

#[test]
fn a_server_among_anybody() {
    let mut sums = [0; 4];
    for seed in 0..25 {
        let mut surrounded = server::Surrounded::new();
        surrounded.obey(&random(seed, 4_000));
        sums = std::array::from_fn(|index| sums[index] + surrounded.counts[index]);
    }
    assert!(sums.iter().all(|sum| *sum > 200), "hardly anything was reached: {sums:?}");
}

#[test]
fn a_client_among_any_robots() {
    let mut sums = [0; 4];
    for seed in 0..300 {
        let mut surrounded = client::Surrounded::new();
        surrounded.connect();
        surrounded.obey(&random(seed, 4_000));
        sums = std::array::from_fn(|index| sums[index] + surrounded.counts[index]);
    }
    assert!(sums.iter().all(|sum| *sum > 300), "hardly anything was reached: {sums:?}");
}
