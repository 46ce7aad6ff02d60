//! Random expressions against a matcher that knows no automaton, on random words, at every place where two walks may meet.

use super::*;
use proptest::prelude::*;
use std::collections::BTreeSet;

/// What is at a vertex: of a light only the names count.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Letter {
    light: bool,
    event: Event,
    scattering: Scattering,
    /// Bit 0: 'a'; bit 1: 'b'.
    names: usize,
}

/// What is written about a vertex.
#[derive(Clone, Debug)]
enum Item {
    Any,
    Event(Event),
    Scattering(Scattering),
    Name(usize),
    All(Vec<Item>),
    Set(bool, Vec<Item>),
}

impl Item {
    fn fits(&self, letter: Letter) -> bool {
        match self {
            Item::Any => true,
            Item::Event(event) => letter.event == *event,
            Item::Scattering(scattering) => letter.scattering == *scattering,
            Item::Name(name) => letter.names & (1 << name) != 0,
            Item::All(items) => items.iter().all(|item| item.fits(letter)),
            Item::Set(negated, items) => items.iter().any(|item| item.fits(letter)) != *negated,
        }
    }

    fn text(&self) -> String {
        let texts = |items: &[Item]| items.iter().map(Item::text).collect::<Vec<_>>().join("");
        match self {
            Item::Any => ".".to_owned(),
            Item::Event(event) => event.letter().to_string(),
            Item::Scattering(scattering) => scattering.letter().to_string(),
            Item::Name(name) => ["'a'", "\"b\""][*name].to_owned(),
            Item::All(items) => format!("<{}>", texts(items)),
            Item::Set(negated, items) => format!("[{}{}]", if *negated { "^" } else { "" }, texts(items)),
        }
    }

    /// Whether it, or a part of it, is impossible, which is refused.
    fn is_refused(&self) -> bool {
        let impossible = !scatterings().any(|letter| self.fits(letter));
        impossible || matches!(self, Item::All(items) | Item::Set(_, items) if items.iter().any(Item::is_refused))
    }
}

/// A pattern of scatterings.
#[derive(Clone, Debug)]
enum Pattern {
    One(Item),
    Sequence(Vec<Pattern>),
    Choice(Vec<Pattern>),
    Repeat(Box<Pattern>, usize, Option<usize>),
}

impl Pattern {
    fn text(&self) -> String {
        let texts =
            |parts: &[Pattern], between: &str| parts.iter().map(Pattern::text).collect::<Vec<_>>().join(between);
        match self {
            Pattern::One(item) => item.text(),
            Pattern::Sequence(parts) => texts(parts, " "),
            Pattern::Choice(parts) => format!("({})", texts(parts, "|")),
            Pattern::Repeat(body, least, most) => {
                let times = match (least, most) {
                    (0, None) => "*".to_owned(),
                    (1, None) => "+".to_owned(),
                    (0, Some(1)) => "?".to_owned(),
                    (n, None) => format!("{{{n},}}"),
                    (n, Some(m)) if n == m => format!("{{ {n} }}"),
                    (n, Some(m)) => format!("{{{n}, {m}}}"),
                };
                format!("({}){times}", body.text())
            }
        }
    }

    /// Where a match that starts at `at` may end.
    fn ends(&self, word: &[Letter], at: usize) -> BTreeSet<usize> {
        let all = |from: &BTreeSet<usize>, part: &Pattern| from.iter().flat_map(|&i| part.ends(word, i)).collect();
        match self {
            Pattern::One(item) => {
                word.get(at).filter(|letter| item.fits(**letter)).map(|_| at + 1).into_iter().collect()
            }
            Pattern::Sequence(parts) => parts.iter().fold(BTreeSet::from([at]), |from, part| all(&from, part)),
            Pattern::Choice(parts) => parts.iter().flat_map(|part| part.ends(word, at)).collect(),
            Pattern::Repeat(body, least, most) => {
                let mut now = BTreeSet::from([at]);
                let mut ends = BTreeSet::new();
                // More turns than letters, beyond those that must be, end nowhere new.
                for turn in 0..=most.unwrap_or(least + word.len()) {
                    if turn >= *least {
                        ends.extend(&now);
                    }
                    now = all(&now, body);
                }
                ends
            }
        }
    }

    fn is_refused(&self) -> bool {
        match self {
            Pattern::One(item) => item.is_refused(),
            Pattern::Sequence(parts) | Pattern::Choice(parts) => parts.iter().any(Pattern::is_refused),
            Pattern::Repeat(body, ..) => body.is_refused(),
        }
    }
}

/// Some patterns, each with what the light must be.
#[derive(Clone, Debug)]
struct Paths(Vec<(Pattern, Option<Item>)>);

impl Paths {
    fn text(&self) -> String {
        let light = |item: &Option<Item>| match item {
            None => "L".to_owned(),
            Some(Item::Name(name)) => format!("L{}", Item::Name(*name).text()),
            Some(item) => format!("<L{}>", item.text()),
        };
        let text = |(pattern, item): &(Pattern, Option<Item>)| format!("C {}{}", pattern.text(), light(item));
        self.0.iter().map(text).collect::<Vec<_>>().join("|")
    }

    fn fit(&self, word: &[Letter]) -> bool {
        let (light, body) = word.split_last().unwrap();
        let fits = |(pattern, item): &(Pattern, Option<Item>)| {
            pattern.ends(body, 0).contains(&body.len()) && item.as_ref().is_none_or(|item| item.fits(*light))
        };
        self.0.iter().any(fits)
    }

    fn expression(&self) -> Option<Expression> {
        let refused =
            self.0.iter().any(|(pattern, item)| pattern.is_refused() || item.as_ref().is_some_and(Item::is_refused));
        match Expression::parse(&self.text()) {
            Ok(expression) => {
                assert!(!refused, "{}", self.text());
                Some(expression)
            }
            Err(error) => {
                assert!(refused, "{error}");
                None
            }
        }
    }
}

fn scatterings() -> impl Iterator<Item = Letter> {
    let kinds = Event::ALL.into_iter().flat_map(|event| Scattering::ALL.map(|scattering| (event, scattering)));
    kinds.flat_map(|(event, scattering)| (0..4).map(move |names| Letter { light: false, event, scattering, names }))
}

fn event() -> impl Strategy<Value = Event> {
    prop::sample::select(Event::ALL.to_vec())
}

fn scattering() -> impl Strategy<Value = Scattering> {
    prop::sample::select(Scattering::ALL.to_vec())
}

fn item() -> impl Strategy<Value = Item> {
    let atom = prop_oneof![
        2 => Just(Item::Any),
        2 => event().prop_map(Item::Event),
        4 => scattering().prop_map(Item::Scattering),
        2 => (0..2_usize).prop_map(Item::Name),
        2 => (event(), scattering(), 0..2_usize)
            .prop_map(|(e, s, n)| Item::All(vec![Item::Event(e), Item::Scattering(s), Item::Name(n)])),
    ];
    atom.prop_recursive(2, 8, 3, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 1..3).prop_map(Item::All),
            (any::<bool>(), prop::collection::vec(inner, 1..4)).prop_map(|(negated, items)| Item::Set(negated, items)),
        ]
    })
}

fn pattern() -> impl Strategy<Value = Pattern> {
    item().prop_map(Pattern::One).prop_recursive(4, 16, 3, |inner| {
        let parts = |inner| prop::collection::vec(inner, 1..4);
        let times = (0..3_usize, prop::option::of(0..3_usize));
        prop_oneof![
            parts(inner.clone()).prop_map(Pattern::Sequence),
            parts(inner.clone()).prop_map(Pattern::Choice),
            (inner, times).prop_map(|(body, (least, more))| {
                let most = more.map(|more| (least + more).max(1));
                Pattern::Repeat(Box::new(body), least, most)
            }),
        ]
    })
}

fn paths() -> impl Strategy<Value = Paths> {
    let named = (0..2_usize).prop_map(Item::Name);
    let unnamed = (0..2_usize).prop_map(|name| Item::Set(true, vec![Item::Name(name)]));
    let light = prop_oneof![3 => Just(None), 2 => named.prop_map(Some), 1 => unnamed.prop_map(Some)];
    prop::collection::vec((pattern(), light), 1..3).prop_map(Paths)
}

fn word() -> impl Strategy<Value = Vec<Letter>> {
    let vertex = (event(), scattering(), 0..4_usize);
    (prop::collection::vec(vertex, 0..7), 0..4_usize).prop_map(|(vertices, names)| {
        let scatter = |(event, scattering, names)| Letter { light: false, event, scattering, names };
        let light = Letter { light: true, event: Event::Reflection, scattering: Scattering::Diffuse, names };
        vertices.into_iter().map(scatter).chain([light]).collect()
    })
}

/// A classifier whose surface and light number n have the names whose bits n has.
fn classifier(expressions: &[Expression]) -> Classifier {
    let entries = names(&[&[], &["a"], &["b"], &["a", "b"]]);
    Classifier::new(expressions, &entries, &entries).unwrap()
}

/// The classes of a word, which must be the same wherever two walks meet.
fn classes(classifier: &Classifier, word: &[Letter]) -> u64 {
    let (light, body) = word.split_last().unwrap();
    let mut found = BTreeSet::new();
    for cut in 0..=body.len() {
        let step = |state, l: &Letter| classifier.camera_step(state, l.event, l.scattering, l.names);
        let camera = body[..cut].iter().fold(classifier.camera_start(), step);
        let step = |state, l: &Letter| classifier.light_step(state, l.event, l.scattering, l.names);
        let lit = body[cut..].iter().rev().fold(classifier.light_start(light.names), step);
        found.insert(classifier.classes(camera, lit));
        if cut == body.len() {
            found.insert(classifier.emitted(camera, light.names));
        }
    }
    assert_eq!(found.len(), 1, "{word:?}");
    found.pop_first().unwrap()
}

fn letters(example: &Example) -> Vec<Letter> {
    let bits = |names: &[String]| names.iter().map(|name| if name == "a" { 1 } else { 2 }).sum();
    let scatter = |(event, scattering, names): &(Event, Scattering, Vec<String>)| Letter {
        light: false,
        event: *event,
        scattering: *scattering,
        names: bits(names),
    };
    let light =
        Letter { light: true, event: Event::Reflection, scattering: Scattering::Diffuse, names: bits(&example.light) };
    example.scatterings.iter().map(scatter).chain([light]).collect()
}

/// All words of up to so many scatterings, of few letters.
fn all_words(most: usize) -> Vec<Vec<Letter>> {
    let few: Vec<Letter> = scatterings().filter(|l| l.event == Event::Reflection && l.names != 2).collect();
    let mut bodies = vec![vec![]];
    let mut last = bodies.clone();
    for _ in 0..most {
        let longer =
            |body: &Vec<Letter>| few.iter().map(|l| body.iter().copied().chain([*l]).collect()).collect::<Vec<_>>();
        last = last.iter().flat_map(longer).collect();
        bodies.extend(last.iter().cloned());
    }
    let light = |names| Letter { light: true, event: Event::Reflection, scattering: Scattering::Diffuse, names };
    let ended = |body: &Vec<Letter>| [0, 1].map(|names| body.iter().copied().chain([light(names)]).collect::<Vec<_>>());
    bodies.iter().flat_map(ended).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn words_are_classified_as_a_naive_matcher_does(
        sets in prop::collection::vec(paths(), 1..4),
        words in prop::collection::vec(word(), 12),
    ) {
        let Some(expressions) = sets.iter().map(Paths::expression).collect::<Option<Vec<_>>>() else { return Ok(()) };
        let classifier = classifier(&expressions);
        let examples = (0..sets.len()).flat_map(|i| classifier.examples(i, 4)).map(|e| letters(&e)).collect::<Vec<_>>();
        for word in words.iter().chain(&examples) {
            let naive = sets.iter().enumerate().map(|(i, set)| u64::from(set.fit(word)) << i).sum::<u64>();
            prop_assert_eq!(classes(&classifier, word), naive, "{:?}", word);
        }
    }

    #[test]
    fn examples_belong_to_their_expressions_and_are_shortest(set in paths()) {
        let Some(expression) = set.expression() else { return Ok(()) };
        let (least, most) = expression.orders();
        let any = Classifier::for_any_scene(std::slice::from_ref(&expression)).unwrap();
        let examples = any.examples(0, 5);
        prop_assert_eq!(examples[0].scatterings.len(), least);
        for (i, example) in examples.iter().enumerate() {
            prop_assert!(set.fit(&letters(example)), "{}", example);
            prop_assert!(most.is_none_or(|most| example.scatterings.len() <= most));
            prop_assert!(!examples[..i].contains(example));
            // What is printed is an expression that has the path.
            let printed = Expression::parse(&example.to_string()).unwrap();
            let both = Classifier::for_any_scene(&[expression.clone(), printed]).unwrap();
            prop_assert_eq!(both.overlap().map(|(_, _, shared)| shared.scatterings.len()), Some(example.scatterings.len()));
        }
        prop_assert!(most.is_some() || examples.len() == 5);
    }

    #[test]
    fn the_reverse_of_the_reverse_is_the_same(set in paths()) {
        let Some(expression) = set.expression() else { return Ok(()) };
        let (mut once, mut twice) = (nfa::Nfa::default(), nfa::Nfa::default());
        let mut predicates = nfa::Predicates::default();
        let numbers: Vec<usize> = (0..2).collect();
        once.add(expression.root(), 0, &numbers, &mut predicates).unwrap();
        twice.add(&expression.root().reversed().reversed(), 0, &numbers, &mut predicates).unwrap();
        let alphabet = alphabet::Alphabet::new(&predicates.list, &[0, 1, 2, 3], &[0, 1, 2, 3]).unwrap();
        let [once, twice] = [once, twice].map(|nfa| dfa::Dfa::of(&nfa, &alphabet).unwrap());
        prop_assert!(once.minimised().states() <= once.states());
        prop_assert_eq!(once.minimised().minimised(), twice.minimised());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn overlaps_and_gaps_are_found_where_words_show_them(sets in prop::collection::vec(paths(), 1..4)) {
        let Some(expressions) = sets.iter().map(Paths::expression).collect::<Option<Vec<_>>>() else { return Ok(()) };
        let any = Classifier::for_any_scene(&expressions).unwrap();
        let fitting = |word: &[Letter]| sets.iter().filter(|set| set.fit(word)).count();
        let (overlap, gap) = (any.overlap(), any.gap());
        if let Some((a, b, path)) = &overlap {
            prop_assert!(a < b && sets[*a].fit(&letters(path)) && sets[*b].fit(&letters(path)));
        }
        if let Some(path) = &gap {
            prop_assert_eq!(fitting(&letters(path)), 0);
        }
        // No word that is shorter than what was found shows it, and none at all where nothing was found.
        let before = |path: Option<&Example>, order: usize| path.is_none_or(|path| order < path.scatterings.len());
        for word in all_words(3) {
            let (order, count) = (word.len() - 1, fitting(&word));
            prop_assert!(count != 0 || !before(gap.as_ref(), order), "gap {:?}", word);
            prop_assert!(count < 2 || !before(overlap.as_ref().map(|o| &o.2), order), "overlap {:?}", word);
        }
    }
}
