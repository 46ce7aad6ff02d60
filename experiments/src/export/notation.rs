//! How orders are written where people read them: `E`, `TE`, `T²E`, … and `rest` for all beyond the last one.

use integrators::Layer;

/// The order as a term of the Neumann series; `sum` for all of them together.
pub fn symbol(layer: Option<Layer>) -> String {
    match layer {
        None => "sum".to_owned(),
        Some(Layer::Order(0)) => "E".to_owned(),
        Some(Layer::Order(1)) => "TE".to_owned(),
        Some(Layer::Order(k)) => format!("T{}E", superscript(k as i64)),
        Some(Layer::Tail) => "rest".to_owned(),
    }
}

/// The order in words: `order 2`; `the sum`; `the rest`.
pub fn words(layer: Option<Layer>) -> String {
    match layer {
        None => "the sum".to_owned(),
        Some(Layer::Order(k)) => format!("order {k}"),
        Some(Layer::Tail) => "the rest".to_owned(),
    }
}

/// Columns of a table by their names, runs of consecutive ones shortened: `E, T²E to T⁵E and T⁷E`.
pub fn listed(columns: &[usize], name: impl Fn(usize) -> String) -> String {
    let runs = columns.chunk_by(|a, b| a + 1 == *b).flat_map(|run| match run {
        [first, .., last] if run.len() > 2 => vec![format!("{} to {}", name(*first), name(*last))],
        _ => run.iter().map(|&i| name(i)).collect(),
    });
    enumerated(runs.collect())
}

/// `a, b and c`.
pub fn enumerated(mut parts: Vec<String>) -> String {
    match (parts.pop(), parts.is_empty()) {
        (None, _) => String::new(),
        (Some(last), true) => last,
        (Some(last), false) => format!("{} and {last}", parts.join(", ")),
    }
}

/// A name as sentences and plots have it: cut where it is longer than any that is meant to be read.
pub fn brief(name: &str) -> String {
    const LONGEST: usize = 40;
    if name.chars().count() <= LONGEST {
        return name.to_owned();
    }
    name.chars().take(LONGEST - 1).chain(['…']).collect()
}

/// The number as an exponent: `⁻¹²`.
pub fn superscript(number: i64) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    number.to_string().chars().map(|c| c.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_orders_are_listed_shortly() {
        let name = |k| symbol(Some(Layer::Order(k)));
        assert_eq!(listed(&[0, 2, 3, 4, 5, 7], name), "E, T²E to T⁵E and T⁷E");
        assert_eq!(listed(&[1, 2], name), "TE and T²E");
        assert_eq!(listed(&[], name), "");
    }

    #[test]
    fn orders_are_terms_of_the_series() {
        let written: Vec<String> = [0, 1, 2, 10].map(|k| symbol(Some(Layer::Order(k)))).into();
        assert_eq!(written, ["E", "TE", "T²E", "T¹⁰E"]);
        assert_eq!((symbol(None).as_str(), symbol(Some(Layer::Tail)).as_str()), ("sum", "rest"));
    }
}
