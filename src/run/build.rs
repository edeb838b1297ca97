//! Identity of this program's build and of the processor's instructions that it uses. Results of the same build on the
//! same class of processors are the same bits.

use std::sync::OnceLock;

use pulp::Arch;

/// Version, commit, profile and features of this build.
pub const BUILD: &str = concat!(env!("CARGO_PKG_VERSION"), " ", env!("KANAGATA_BUILD"));

/// [`BUILD`] and the class of the processor, for `--version`.
#[must_use]
pub fn version() -> &'static str {
    static VERSION: OnceLock<String> = OnceLock::new();
    VERSION.get_or_init(|| format!("{BUILD} {}", cpu_class()))
}

/// Class of the processor's vector instructions that are used: `x86-v4` (AVX-512), `x86-v3` (AVX2 and FMA), `aarch64`, or
/// `scalar`. Sums of different classes differ in rounding.
#[must_use]
pub fn cpu_class() -> &'static str {
    match Arch::new() {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(_) => "x86-v4",
        #[cfg(target_arch = "x86_64")]
        Arch::V3(_) => "x86-v3",
        #[cfg(target_arch = "aarch64")]
        Arch::Neon(_) => "aarch64",
        _ => "scalar",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_build_names_its_version_and_the_processor_its_class() {
        let parts: Vec<&str> = BUILD.split(' ').collect();
        assert_eq!(parts.len(), 4, "{BUILD}");
        assert_eq!(parts[0], env!("CARGO_PKG_VERSION"));
        assert!(["x86-v4", "x86-v3", "aarch64", "scalar"].contains(&cpu_class()));
    }
}
