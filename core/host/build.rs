//! Makes cargo set `OUT_DIR`, from which the catalogue knows where the plugins of a source build lie.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
}
