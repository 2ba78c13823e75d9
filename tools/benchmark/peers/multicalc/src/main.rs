//! multicalc's ParticleFilter on the work of the peers (../work.h tells the file and what is printed), in f64, or f32
//! with the feature `single`. Its process noise covers every state: it draws 4 normals where the work asks for 2, those
//! of speed and heading next to nothing.
use multicalc::estimation::{GaussianLikelihood, ParticleFilter};
use multicalc::linear_algebra::{Matrix, Vector};
use multicalc::scalar::{Numeric, VectorFn};
use std::time::Instant;

#[cfg(feature = "single")]
type Real = f32;
#[cfg(not(feature = "single"))]
type Real = f64;

const TINY: f64 = 1e-12; // a variance of zero is refused

struct Motion {
    numbers: [f64; 12],
    throttle: f64,
    tan_steer: f64,
}

impl VectorFn<4, 4> for Motion {
    #[inline]
    fn eval<S: Numeric>(&self, x: &[S; 4]) -> [S; 4] {
        let [dt, power, drag, mass, base, least, ..] = self.numbers;
        let v = x[2];
        let least = S::from_f64(least);
        let guarded = if v > least { v } else { least };
        let drive = S::from_f64(power * self.throttle) / guarded - S::from_f64(drag) * v * v;
        [
            x[0] + S::from_f64(dt) * v * x[3].cos(),
            x[1] + S::from_f64(dt) * v * x[3].sin(),
            v + S::from_f64(dt / mass) * drive,
            x[3] + S::from_f64(dt * self.tan_steer / base) * v,
        ]
    }
}

struct Seen;

impl VectorFn<4, 3> for Seen {
    #[inline]
    fn eval<S: Numeric>(&self, x: &[S; 4]) -> [S; 3] {
        [x[0], x[1], x[2]]
    }
}

pub struct Peer {
    filter: ParticleFilter<4, 3, Real>,
    sensor: GaussianLikelihood<3, Real>,
    motion: Motion,
    resampled: u32,
}

fn diagonal<const N: usize>(of: impl Fn(usize) -> f64) -> Matrix<N, N, Real> {
    Matrix::new(std::array::from_fn(|r| std::array::from_fn(|c| if r == c { of(r) as Real } else { 0.0 })))
}

fn start(numbers: [f64; 12], n: usize, seed: u64) -> Peer {
    let sigma = numbers[0] * numbers[6];
    let first = Vector::from_fn(|d| numbers[8 + d] as Real);
    let noise = diagonal(|d| if d < 2 { sigma * sigma } else { TINY });
    Peer {
        filter: ParticleFilter::new(n, first, diagonal(|_| TINY), noise, seed).unwrap(),
        sensor: GaussianLikelihood::new(diagonal(|_| numbers[7] * numbers[7])).unwrap(),
        motion: Motion { numbers, throttle: 0.0, tan_steer: 0.0 },
        resampled: 0,
    }
}

/// Counted and timed. The mean is that of the resampled cloud: the filter gives no other.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn peer_cycle(peer: &mut Peer, step: &[f64; 7], mean: &mut [f64; 2]) {
    peer.motion.throttle = step[0];
    peer.motion.tan_steer = step[1].tan();
    peer.filter.predict(&peer.motion).unwrap();
    let measured = Vector::from_fn(|k| step[2 + k] as Real);
    peer.filter.update(&Seen, &peer.sensor, measured).unwrap();
    let x = peer.filter.mean();
    *mean = [x[0] as f64, x[1] as f64];
    let w = peer.filter.weights();
    peer.resampled += (w[0] == w[1] && w[0] == w[w.len() - 1]) as u32;
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let text = std::fs::read_to_string(&arguments[1]).unwrap();
    let all: Vec<f64> = text.split_whitespace().map(|word| word.parse().unwrap()).collect();
    let [n, flights, repeats] = [2, 3, 4].map(|k: usize| arguments[k].parse::<usize>().unwrap());
    let steps = all[1] as usize;
    let numbers: [f64; 12] = all[2..14].try_into().unwrap();
    let (mut square, mut ns, mut resampled) = (0.0, 0.0, 0);
    for f in 0..flights {
        let mut best = vec![f64::INFINITY; steps];
        for r in 0..repeats {
            let mut peer = start(numbers, n, f as u64 + 1);
            for (k, least) in best.iter_mut().enumerate() {
                let at = 14 + 7 * (f * steps + k);
                let step: &[f64; 7] = all[at..at + 7].try_into().unwrap();
                let mut mean = [0.0; 2];
                let begin = Instant::now();
                peer_cycle(&mut peer, step, &mut mean);
                *least = least.min(begin.elapsed().as_nanos() as f64);
                if r == 0 {
                    square += (mean[0] - step[5]).powi(2) + (mean[1] - step[6]).powi(2);
                }
            }
            resampled += if r == 0 { peer.resampled } else { 0 };
        }
        ns += best.iter().sum::<f64>();
    }
    println!("rmse {:.6}", (square / (flights * steps) as f64).sqrt());
    println!("ns {:.3}", ns / (flights * steps * n) as f64);
    println!("resampled {:.4}", resampled as f64 / (flights * steps) as f64);
}
