//! Names and versions of the programs and libraries that take part in a result.

use std::collections::BTreeMap;

/// The lock file that this program was built with.
const LOCK: &str = include_str!("../../Cargo.lock");
/// Libraries whose version can change a result.
const LIBRARIES: [&str; 5] = ["argmin", "clarabel", "faer", "nalgebra", "rand_chacha"];

/// This program's version.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// `autotune` and the libraries with their versions. Where the lock file has several of a library, the newest is named.
pub fn versions() -> BTreeMap<String, String> {
    let mut versions = BTreeMap::from([("autotune".to_owned(), VERSION.to_owned())]);
    for library in LIBRARIES {
        let head = format!("name = \"{library}\"\nversion = \"");
        let newest = LOCK.split(&head).skip(1).filter_map(|rest| rest.split('"').next()).last();
        if let Some(version) = newest {
            versions.insert(library.to_owned(), version.to_owned());
        }
    }
    versions
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_library_is_in_the_lock_file() {
        let versions = super::versions();
        assert_eq!(versions.len(), 1 + super::LIBRARIES.len());
        assert!(versions.values().all(|version| version.starts_with(|c: char| c.is_ascii_digit())));
    }
}
