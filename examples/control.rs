//! Does it pay to combine what several methods estimate of the same orders, and to use orders as control variates for one another? The table in
//! `docs/composite.md`:
//!
//! ```console
//! $ cargo run --release --example control
//! ```
//!
//! Any weights `w_mk` with `Σ_m w_mk = 1` give an unbiased image `Σ_m Σ_k w_mk L_mk`, L_mk being what method m estimates of order k. Where each of them is
//! 0 or 1 that is a composite; where they are not, an order is a combination of methods; and since `L_1j − L_2j` has the mean 0, weights of order j can
//! take variance from order k: control variates are among them. So one quadratic problem has all of it: with n_m samples, V_m(w) = wᵀ C_m w being the
//! variance of one, and c_m its seconds, `(Σ V_m / n_m) (Σ n_m c_m)` is to be least. Weights are found from pilots, and are judged by others, on other
//! random numbers: what fits the noise of the first is no gain.

use integrators::{Layer, Methods, Orders, RenderSettings};
use neumann::choice::entrants;
use neumann::choice::pilot::{Entry, candidates, of_all};
use neumann::choice::search::{Candidate, best, product, sets, shares};
use neumann::stop::Stop;
use sampling::sampler::{Role, SamplerKind};
use scenes::{LoadOptions, Scene};

const SIZE: (u32, u32) = (32, 32);
const REPLICATES: u32 = 32;
const SAMPLES: u32 = 64;
const MAX_ORDER: usize = 8;
/// Rounds of weights for given samples, and samples for given weights.
const ROUNDS: usize = 20;

/// Weights of every method's layers, and its share of the samples.
struct Plan {
    weights: Vec<Vec<f64>>,
    shares: Vec<f64>,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("| scene | best alone | a method an order | any weights | promised | of methods |");
    println!("|---|---|---:|---:|---:|---|");
    let methods = Methods::standard();
    for name in scenes::builtin::NAMES {
        let scene = scenes::load(name, &LoadOptions { size: Some(SIZE), ..LoadOptions::default() })?;
        let ((labels, first), (_, second)) = (pilots(&scene, &methods, 1)?, pilots(&scene, &methods, 2)?);
        let (assignment, Some(single)) = best(&first).map_err(|k| format!("nothing carries layer {k}"))? else {
            continue;
        };
        let alone = of_sets(&first, &sets(&vec![single; assignment.len()], first.len()));
        let composite = of_sets(&first, &sets(&assignment, first.len()));
        let (used, combined) = any_weights(&first);
        let gain = |of: &[Candidate], plan: &Plan| judged(of, &alone) / judged(of, plan);
        let names: Vec<&str> = used.iter().map(|&m| labels[m].as_str()).collect();
        println!(
            "| `{name}` | `{}` | {:.2} | {:.2} | {:.2} | {} |",
            labels[single],
            gain(&second, &composite),
            gain(&second, &combined),
            gain(&first, &combined),
            names.join(", ")
        );
    }
    Ok(())
}

/// The methods, and what is known of each by pilots of this number, for the image as a whole.
fn pilots(
    scene: &Scene,
    methods: &Methods,
    number: u32,
) -> Result<(Vec<String>, Vec<Candidate>), Box<dyn std::error::Error>> {
    let settings = RenderSettings {
        orders: Orders::up_to(MAX_ORDER),
        tail: false,
        samples_per_replicate: SAMPLES,
        seed: 0,
        sampler: SamplerKind::Independent,
        instance: String::new(),
        role: Role::Pilot,
    };
    let layers: Vec<Layer> = (0..=MAX_ORDER).map(Layer::Order).collect();
    let part = entrants(scene, methods, &mut Vec::new())?;
    let entries: Vec<Entry> = part.iter().map(|(run, m)| Entry::new(scene, run, &**m, &settings, &layers)).collect();
    let pilots = of_all(scene, &entries, &layers, (number, SAMPLES, REPLICATES), &Stop::never())?;
    let mut found = candidates(scene, &entries, &pilots, &layers, &Stop::never())?;
    found.iter_mut().for_each(|candidate| candidate.cells.clear());
    Ok((part.iter().map(|(run, _)| run.label()).collect(), found))
}

/// The plan that gives every layer whole to one method.
fn of_sets(candidates: &[Candidate], sets: &[Vec<usize>]) -> Plan {
    let weights: Vec<Vec<f64>> = sets
        .iter()
        .zip(candidates)
        .map(|(set, candidate)| (0..candidate.carries.len()).map(|k| f64::from(u8::from(set.contains(&k)))).collect())
        .collect();
    shared(candidates, weights)
}

/// With the best shares of the samples for such weights.
fn shared(candidates: &[Candidate], weights: Vec<Vec<f64>>) -> Plan {
    let busy: Vec<usize> = (0..weights.len()).filter(|&m| !support(&weights[m]).is_empty()).collect();
    let of_busy = shares(&busy.iter().map(|&m| work(&candidates[m], &weights[m])).collect::<Vec<_>>());
    let mut shares = vec![0.0; weights.len()];
    busy.iter().zip(of_busy).for_each(|(&m, share)| shares[m] = share);
    Plan { weights, shares }
}

/// Variance times seconds of a plan, by what these pilots found.
fn judged(candidates: &[Candidate], plan: &Plan) -> f64 {
    let busy: Vec<usize> = (0..candidates.len()).filter(|&m| plan.shares[m] > 0.0).collect();
    let runs: Vec<(f64, f64)> = busy.iter().map(|&m| work(&candidates[m], &plan.weights[m])).collect();
    product(&runs, &busy.iter().map(|&m| plan.shares[m]).collect::<Vec<_>>())
}

fn support(weights: &[f64]) -> Vec<usize> {
    (0..weights.len()).filter(|&k| weights[k] != 0.0).collect()
}

/// Variance and seconds of one sample with such weights.
fn work(candidate: &Candidate, weights: &[f64]) -> (f64, f64) {
    let count = weights.len();
    let pairs = (0..count * count).map(|at| weights[at / count] * candidate.covariance[at] * weights[at % count]);
    (pairs.sum::<f64>().max(0.0), candidate.cost.of(&support(weights)))
}

/// The best weights of any two or more methods, and which these are.
fn any_weights(candidates: &[Candidate]) -> (Vec<usize>, Plan) {
    let subsets = (1..1_usize << candidates.len()).filter(|subset| subset.count_ones() > 1);
    let mut found: Vec<(f64, Vec<usize>, Plan)> = Vec::new();
    for subset in subsets {
        let used: Vec<usize> = (0..candidates.len()).filter(|m| subset >> m & 1 == 1).collect();
        let layers = candidates[0].carries.len();
        if !(0..layers).all(|k| used.iter().any(|&m| candidates[m].carries[k])) {
            continue;
        }
        let mut samples = vec![1.0; candidates.len()];
        let mut plan = None;
        for _ in 0..ROUNDS {
            let next = shared(candidates, weights(candidates, &used, &samples));
            samples.clone_from(&next.shares);
            plan = Some(next);
        }
        if let Some(plan) = plan {
            found.push((judged(candidates, &plan), used, plan));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (_, used, plan) = found.swap_remove(0);
    (used, plan)
}

/// The weights of least variance for given samples: Lagrange's conditions `C_m w_m / n_m = λ`, `Σ_m w_m = 1`.
fn weights(candidates: &[Candidate], used: &[usize], samples: &[f64]) -> Vec<Vec<f64>> {
    let layers = candidates[0].carries.len();
    let unknown: Vec<(usize, usize)> = used
        .iter()
        .flat_map(|&m| (0..layers).filter(move |&k| candidates[m].carries[k]).map(move |k| (m, k)))
        .collect();
    let size = unknown.len() + layers;
    let scale =
        used.iter().flat_map(|&m| candidates[m].covariance.iter()).fold(f64::MIN_POSITIVE, |a, b| a.max(b.abs()));
    let mut rows = vec![vec![0.0; size + 1]; size];
    for (i, &(m, k)) in unknown.iter().enumerate() {
        for (j, &(other, l)) in unknown.iter().enumerate() {
            if other == m {
                rows[i][j] = candidates[m].covariance[k * layers + l] / scale / samples[m].max(1e-6);
            }
        }
        // What does not vary is any method's.
        rows[i][i] += 1e-9;
        (rows[i][unknown.len() + k], rows[unknown.len() + k][i]) = (-1.0, 1.0);
    }
    (0..layers).for_each(|k| rows[unknown.len() + k][size] = 1.0);
    let solution = solved(rows);
    let mut weights = vec![vec![0.0; layers]; candidates.len()];
    unknown.iter().zip(solution).for_each(|(&(m, k), w)| weights[m][k] = w);
    weights
}

/// Solves linear equations, the right side in the last column, by Gauss's elimination with pivots.
fn solved(mut rows: Vec<Vec<f64>>) -> Vec<f64> {
    let size = rows.len();
    for column in 0..size {
        let pivot = (column..size).max_by(|&a, &b| rows[a][column].abs().total_cmp(&rows[b][column].abs()));
        rows.swap(column, pivot.unwrap_or(column));
        let top = rows[column].clone();
        for row in rows.iter_mut().skip(column + 1) {
            let factor = row[column] / top[column];
            row.iter_mut().zip(&top).skip(column).for_each(|(x, t)| *x -= factor * t);
        }
    }
    let mut solution = vec![0.0; size];
    for i in (0..size).rev() {
        let known: f64 = (i + 1..size).map(|j| rows[i][j] * solution[j]).sum();
        solution[i] = (rows[i][size] - known) / rows[i][i];
    }
    solution
}
