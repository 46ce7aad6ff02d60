//! The second pilot: what the runs that were chosen take and leave, on random numbers that they were not chosen by.

use super::budget::{Budget, second_size};
use super::first::First;
use super::pilot::{Entry, Pilot, mean, take_turns};
use super::regions::Division;
use super::timing::Timing;
use super::{Choice, ChosenRun, search};
use crate::error::Error;
use crate::statistics::positive::{Stratum, log_sum, recursion};
use crate::stop::Stop;
use integrators::composite::{Regions, Run};
use integrators::{Layer, Methods};
use scenes::Scene;

/// The part of an undivided image's product of variance and seconds below which a divided one's must lie.
const PAYS: f64 = 0.96;
/// The gain above which more pilots may be worth their time, where its interval reaches below 1.
const WORTH: f64 = 1.1;

/// Layers that were left to a candidate, and the division of the image for them.
pub struct Group {
    /// The candidate.
    pub m: usize,
    /// Which of the layers.
    pub set: Vec<usize>,
    /// The same by name.
    pub layers: Vec<Layer>,
    /// The regions, if it may have such.
    pub division: Option<Division>,
}

/// A second pilot, as far as it tells of a group's layers.
struct View {
    /// Its number.
    pilot: usize,
    /// What these layers take of its seconds.
    part: f64,
}

/// A group as the second pilot finds it.
struct Judged {
    /// What each replicate but the first adds to the variance of one sample.
    squares: Vec<f64>,
    /// Seconds of one sample.
    seconds: f64,
    /// The runs: candidate, regions, and parts of the samples and of the seconds.
    runs: Vec<(usize, Option<Regions>, f64, f64)>,
}

impl Judged {
    /// Variance and seconds of one sample.
    fn found(&self) -> (f64, f64) {
        (mean(&self.squares), self.seconds)
    }

    /// Their product.
    fn product(&self) -> f64 {
        mean(&self.squares) * self.seconds
    }
}

impl Group {
    /// The candidates whose pilots it needs, its own first.
    pub fn methods(&self) -> Vec<usize> {
        self.division.as_ref().map_or(vec![self.m], |division| division.methods.iter().map(|(m, _)| *m).collect())
    }

    /// What its pilots have found, in the order of [`methods`](Self::methods). The image stays undivided where a division does not pay.
    fn judge(&self, views: &[View], pilots: &[Pilot]) -> Judged {
        let pilot = |view: &View| (&pilots[view.pilot], pilots[view.pilot].seconds() * view.part);
        let (own, seconds) = pilot(&views[0]);
        let whole = Judged { squares: own.squares(&self.layers), seconds, runs: vec![(self.m, None, 1.0, 1.0)] };
        let Some(division) = &self.division else { return whole };
        let mut divided = Judged { squares: vec![0.0; whole.squares.len()], seconds: 0.0, runs: Vec::new() };
        let mut parts = Vec::new();
        for (method, view) in views.iter().enumerate() {
            let (own, seconds) = pilot(view);
            let squares = division.squares(method, &own.squares_of_cells(&self.layers));
            divided.squares.iter_mut().zip(squares).for_each(|(sum, square)| *sum += square);
            parts.push(division.seconds(method, seconds));
        }
        divided.seconds = parts.iter().sum();
        if divided.product().is_nan() || divided.product() >= PAYS * whole.product() {
            return whole;
        }
        let run = |(method, &(m, _)): (usize, &(usize, Vec<f64>))| {
            let (regions, part) = division.regions(method)?;
            Some((m, Some(regions), part, parts[method] / divided.seconds))
        };
        let runs = division.methods.iter().enumerate().filter_map(run).collect();
        Judged { runs, ..divided }
    }
}

/// Measures the runs chosen and the best methods that carry all layers by a second pilot. Where the gain is great and yet in doubt, it goes on. Then the
/// composite itself is timed beside the best of these methods.
///
/// # Errors
/// If a method cannot render, or the user asked for an end.
pub fn confirm(
    scene: &Scene,
    methods: &Methods,
    (first, groups): (&First, &[Group]),
    mut budget: Budget,
    stop: &Stop,
) -> Result<Choice, Error> {
    let (entries, layers) = (first.entries, first.layers);
    let rivals = first.rivals();
    let (asked, views) = asked(first, groups, &rivals);
    let turn: f64 = asked.iter().map(|asked| first.pilots[asked.m].seconds() * asked.part).sum();
    let (replicates, samples) = second_size(budget.second(), turn);
    let pilot = |asked: &Asked| {
        Pilot::new(scene, entries[asked.m].method, entries[asked.m].of_layers(asked.layers, asked.number, samples))
    };
    let mut pilots = asked.iter().map(pilot).collect::<Result<Vec<Pilot>, Error>>()?;
    take_turns(&mut pilots, replicates, stop)?;
    if Found::new(first, groups, &rivals, &views, &pilots).may_be_worth_more() {
        budget.extend();
        take_turns(&mut pilots, (budget.second() / (turn * f64::from(samples))) as u32, stop)?;
    }
    let found = Found::new(first, groups, &rivals, &views, &pilots);
    let choice = Choice {
        single: found.single.as_ref().map_or(String::new(), |single| entries[single.m].run.label()),
        gain: None,
        gain_interval: None,
        left_out: Vec::new(),
        pilot_seconds: 0.0,
        runs: found.runs(entries),
    };
    let (Some(single), Some(gain)) = (&found.single, found.gain(None)) else { return Ok(choice) };
    let is_single = matches!(&choice.runs[..], [only] if only.run.regions.is_none()) && groups[0].m == single.m;
    let alone = || {
        let runs = vec![alone_run(&entries[single.m], layers, single.second.variance(layers))];
        Ok(Choice { gain: Some(1.0), runs, ..choice.clone() })
    };
    if is_single || gain.most() < 1.0 {
        return alone();
    }
    let pair = found.seconds() + single.second.seconds();
    let timing = Timing::new(scene, methods, (&choice.runs, &entries[single.m], layers), (&budget, pair), stop)?;
    match found.gain(Some(&timing)) {
        // A division is for what it is known to win: rare bright samples in a pilot make one method look bad, and the interval wide.
        Some(gain) if gain.least() < 1.0 => alone(),
        Some(gain) => Ok(Choice { gain: Some(gain.value), gain_interval: gain.interval, ..choice }),
        None => Ok(choice),
    }
}

/// A second pilot to be made.
struct Asked<'a> {
    m: usize,
    layers: &'a [Layer],
    /// What these layers take of the candidate's seconds.
    part: f64,
    /// What tells pilots from one another.
    number: u32,
}

/// The second pilots, those of the rivals first, and by group which of them tell of it. What a rival's pilot tells of a group's layers is told beside what
/// it tells of all: the same bright samples are in both.
fn asked<'a>(first: &First<'a>, groups: &'a [Group], rivals: &[usize]) -> (Vec<Asked<'a>>, Vec<Vec<View>>) {
    let whole = |&m: &usize| Asked { m, layers: first.layers, part: 1.0, number: 4 };
    let mut asked: Vec<Asked> = rivals.iter().map(whole).collect();
    let mut views = Vec::new();
    for group in groups {
        let mut view = |m: usize| {
            let part = first.part(m, &group.set);
            let of_rival = rivals.iter().position(|rival| *rival == m).map(|pilot| View { pilot, part });
            of_rival.unwrap_or_else(|| {
                asked.push(Asked { m, layers: &group.layers, part, number: 2 });
                View { pilot: asked.len() - 1, part: 1.0 }
            })
        };
        views.push(group.methods().into_iter().map(&mut view).collect());
    }
    (asked, views)
}

/// What second pilots have found.
struct Found<'p> {
    first: &'p First<'p>,
    groups: &'p [Group],
    views: &'p [Vec<View>],
    pilots: &'p [Pilot<'p>],
    judged: Vec<Judged>,
    /// Of the samples.
    shares: Vec<f64>,
    single: Option<Single<'p>>,
}

/// A gain, and where it may lie.
struct Gain {
    value: f64,
    interval: Option<(f64, f64)>,
}

impl Gain {
    /// The lower end of the interval.
    fn least(&self) -> f64 {
        self.interval.map_or(self.value, |(low, _)| low)
    }

    /// The upper end.
    fn most(&self) -> f64 {
        self.interval.map_or(self.value, |(_, high)| high)
    }
}

impl<'p> Found<'p> {
    /// By the pilots of the rivals and then those of the groups' other methods.
    fn new(
        first: &'p First<'p>,
        groups: &'p [Group],
        rivals: &[usize],
        views: &'p [Vec<View>],
        pilots: &'p [Pilot<'p>],
    ) -> Self {
        let judged: Vec<Judged> = groups.iter().zip(views).map(|(group, views)| group.judge(views, pilots)).collect();
        let shares = search::shares(&judged.iter().map(Judged::found).collect::<Vec<_>>());
        Self { first, groups, views, pilots, judged, shares, single: Single::best(first, rivals, pilots) }
    }

    /// The variance of one sample of the composite.
    fn variance(&self) -> f64 {
        self.judged.iter().zip(&self.shares).map(|(judged, share)| judged.found().0 / share).sum()
    }

    /// Its seconds.
    fn seconds(&self) -> f64 {
        self.judged.iter().zip(&self.shares).map(|(judged, share)| judged.seconds * share).sum()
    }

    /// The runs.
    fn runs(&self, entries: &[Entry]) -> Vec<ChosenRun> {
        let time = self.seconds();
        let mut runs = Vec::new();
        for ((group, judged), share) in self.groups.iter().zip(&self.judged).zip(&self.shares) {
            runs.extend(judged.runs.iter().map(|(m, regions, samples, seconds)| ChosenRun {
                run: Run { regions: regions.clone(), ..run_of(&entries[*m], &group.layers, share * samples) },
                layers: group.layers.iter().map(|layer| layer.label()).collect(),
                time: judged.seconds * share * seconds / time,
                variance: judged.found().0 / share,
                single: self.single.as_ref().map(|single| single.second.variance(&group.layers)),
            }));
        }
        runs
    }

    /// Over the best method by itself, by the seconds that each has taken alone or by those of the composite. `None` if there is no such method, or
    /// nothing varies.
    fn gain(&self, timing: Option<&Timing>) -> Option<Gain> {
        let second = self.single.as_ref()?.second;
        let seconds = timing.map_or(second.seconds() / self.seconds(), |timing| timing.ratio);
        let value = second.variance(self.first.layers) / self.variance() * seconds;
        value.is_finite().then(|| Gain { value, interval: self.interval(value, second, timing) })
    }

    /// Whether more of the same may be worth its time.
    fn may_be_worth_more(&self) -> bool {
        self.gain(None).is_some_and(|gain| gain.value > WORTH && gain.least() < 1.0)
    }

    /// What the gain may be, as far as variances and seconds are known: that of the best method by itself over those of the groups, to the power of the
    /// parts of Σ √(V c) that they have. Images were made by turns, and what slows a turn slows all of them.
    fn interval(&self, gain: f64, second: &Pilot, timing: Option<&Timing>) -> Option<(f64, f64)> {
        let whole: f64 = self.judged.iter().map(|judged| judged.product().sqrt()).sum();
        let own = second.squares(self.first.layers);
        let mut squares = vec![(1.0, &own[..])];
        let mut seconds = vec![(1.0, second.times())];
        for (judged, views) in self.judged.iter().zip(self.views) {
            let part = judged.product().sqrt() / whole;
            squares.push((-part, &judged.squares));
            seconds.push((-part, self.pilots[views[0].pilot].times()));
        }
        if let Some(timing) = timing {
            seconds = vec![(1.0, &timing.other), (-1.0, &timing.own)];
        }
        interval(gain, squares, seconds)
    }
}

/// What a product of means may be, of squares and of seconds, each to its power.
fn interval(value: f64, mut squares: Vec<(f64, &[f64])>, seconds: Vec<(f64, &[f64])>) -> Option<(f64, f64)> {
    // What does not vary has no part of the doubt.
    squares.retain(|(_, squares)| squares.iter().sum::<f64>() > 0.0);
    let scale = recursion(squares.first()?.1.len());
    let (_, (below, above)) = log_sum(&[Stratum::new(squares), Stratum::new(seconds)], scale, 0)?;
    Some((value * (-below).exp(), value * above.exp()))
}

/// The best method by itself.
struct Single<'p> {
    m: usize,
    second: &'p Pilot<'p>,
}

impl<'p> Single<'p> {
    /// The best of the rivals by the variances of both of their pilots, so that it is not chosen for what one of them finds, and by the seconds of the second
    /// alone: times of day differ in speed, and these were taken by turns with the runs'.
    fn best(first: &First, rivals: &[usize], second: &'p [Pilot<'p>]) -> Option<Self> {
        let product = |&(i, &m): &(usize, &usize)| {
            let pilots = [&first.pilots[m], &second[i]];
            let [a, b] = pilots.map(|pilot| (pilot.variance(first.layers), pilot.samples()));
            (a.0 * a.1 + b.0 * b.1) / (a.1 + b.1) * second[i].seconds()
        };
        let best = rivals.iter().enumerate().min_by(|a, b| product(a).total_cmp(&product(b)));
        best.map(|(i, m)| Self { m: *m, second: &second[i] })
    }
}

/// The best method by itself, where no division is better.
fn alone_run(entry: &Entry, layers: &[Layer], variance: f64) -> ChosenRun {
    let run = run_of(entry, layers, 1.0);
    ChosenRun { run, layers: layers.iter().map(|l| l.label()).collect(), time: 1.0, variance, single: Some(variance) }
}

fn run_of(entry: &Entry, layers: &[Layer], share: f64) -> Run {
    let orders = entry.settings.orders.clone().only(|k| layers.contains(&Layer::Order(k)));
    Run { orders: orders.to_string(), tail: layers.contains(&Layer::Tail), share, ..entry.run.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_from_the_same_images_has_no_doubt_beside_itself() {
        let squares = [1.0, 5.0, 0.5, 2.0, 9.0, 0.1, 3.0, 1.5];
        let other = [2.0, 0.3, 4.0, 1.0, 2.5, 6.0, 0.7, 1.1];
        let width = |squares, seconds| {
            let (low, high): (f64, f64) = interval(2.0, squares, seconds).unwrap();
            (high / low).ln()
        };
        let even = || vec![(1.0, &squares[..]), (-1.0, &squares[..])];
        assert!(width(even(), even()) < 1e-12);
        assert!(width(vec![(1.0, &squares[..]), (-1.0, &other[..])], even()) > 0.5);
        // Two groups read from the images of the best method are in doubt by what differs.
        let halves = vec![(1.0, &squares[..]), (-0.5, &squares[..]), (-0.5, &other[..])];
        let (half, all) = (width(halves, even()), width(vec![(1.0, &squares[..])], even()));
        assert!(half > 0.1 && half < all, "{half} {all}");
        assert!(interval(1.0, vec![(1.0, &[0.0; 8][..])], even()).is_none());
    }
}
