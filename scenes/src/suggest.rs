//! The nearest valid name to one that is not.

use std::path::Path;

/// The most names that a message lists.
const MOST_LISTED: usize = 60;
/// How much of a name is compared \[characters\].
const COMPARED: usize = 100;

/// `did you mean X? (valid: …)`, or only the valid names where none is near.
pub(crate) fn did_you_mean(name: &str, valid: &[&str]) -> String {
    if valid.is_empty() {
        return "there is none to name".to_string();
    }
    let mut listed: Vec<String> = valid.iter().take(MOST_LISTED).map(|valid| format!("`{}`", shown(valid))).collect();
    if valid.len() > MOST_LISTED {
        listed.push(format!("and {} more", valid.len() - MOST_LISTED));
    }
    let listed = listed.join(", ");
    match nearest(name, valid).map(shown) {
        Some(near) => format!("did you mean `{near}`? (valid: {listed})"),
        None => format!("valid are {listed}"),
    }
}

/// The member of `valid` nearest to `name` in spelling, if any is near at all.
pub fn nearest<'a>(name: &str, valid: &[&'a str]) -> Option<&'a str> {
    let compared = |name: &str| name.chars().take(COMPARED).collect::<String>().to_lowercase();
    let name = compared(name);
    let likeness = |candidate: &&'a str| (strsim::jaro_winkler(&name, &compared(candidate)), *candidate);
    let (likeness, best) = valid.iter().map(likeness).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (likeness > 0.7).then_some(best)
}

/// The beginning of a word, on one line, as errors show it.
pub(crate) fn shown(word: &str) -> String {
    let mut text: String = word.chars().take(40).collect();
    if text.len() < word.len() {
        text.push('…');
    }
    text.escape_debug().to_string().replace("\\'", "'")
}

/// What may have been meant by the path of a file that is not there, as the beginning of a mend: "did you mean `box.obj`? ", or nothing.
pub(crate) fn near_file(path: &Path) -> String {
    near_path(path, Path::is_file)
}

/// The same for a folder.
pub(crate) fn near_folder(path: &Path) -> String {
    near_path(path, Path::is_dir)
}

fn near_path(path: &Path, is_such: fn(&Path) -> bool) -> String {
    let near = || {
        let wanted = path.file_name()?.to_str()?;
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let entries = std::fs::read_dir(folder).ok()?.filter_map(Result::ok).filter(|entry| is_such(&entry.path()));
        let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
        names.sort_unstable();
        nearest(wanted, &names.iter().map(String::as_str).collect::<Vec<_>>()).map(str::to_owned)
    };
    near().map_or(String::new(), |near| format!("did you mean `{near}`? "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_the_nearest() {
        let valid = ["lambert", "mirror", "dielectric"];
        assert_eq!(nearest("lambertian", &valid), Some("lambert"));
        assert_eq!(nearest("Miror", &valid), Some("mirror"));
        assert_eq!(nearest("zzz", &valid), None);
        assert_eq!(nearest("x", &[]), None);
    }

    #[test]
    fn many_names_and_long_ones_make_no_long_message() {
        let names: Vec<String> = (0..100_000).map(|i| format!("material_{i}")).collect();
        let told = did_you_mean("materiel_7", &names.iter().map(String::as_str).collect::<Vec<_>>());
        assert!(told.starts_with("did you mean `material_7`?") && told.ends_with("and 99940 more)"), "{told}");
        let long = "x\n".repeat(1_000_000);
        let told = did_you_mean(&long, &[&long]);
        assert!(told.len() < 300 && !told.contains('\n'), "{told}");
    }
}
