//! The nearest valid name to one that is not.

use std::path::Path;

/// `did you mean X? (valid: …)`, or only the valid names where none is near.
pub(crate) fn did_you_mean(name: &str, valid: &[&str]) -> String {
    let listed = valid.iter().map(|v| format!("`{v}`")).collect::<Vec<_>>().join(", ");
    match nearest(name, valid) {
        Some(near) => format!("did you mean `{near}`? (valid: {listed})"),
        None => format!("valid are {listed}"),
    }
}

/// The member of `valid` nearest to `name` in spelling, if any is near at all.
pub fn nearest<'a>(name: &str, valid: &[&'a str]) -> Option<&'a str> {
    let likeness = |candidate: &str| strsim::jaro_winkler(&name.to_lowercase(), &candidate.to_lowercase());
    let best = valid.iter().copied().max_by(|a, b| likeness(a).total_cmp(&likeness(b)))?;
    (likeness(best) > 0.7).then_some(best)
}

/// The name of the file in the folder of `path` that is spelled most like its own, if any is.
pub(crate) fn near_file(path: &Path) -> Option<String> {
    let wanted = path.file_name()?.to_str()?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).ok()?.filter_map(Result::ok).filter(|entry| entry.path().is_file());
    let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort_unstable();
    nearest(wanted, &names.iter().map(String::as_str).collect::<Vec<_>>()).map(str::to_owned)
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
}
