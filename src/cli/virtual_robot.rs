use crate::wire::meca500::revision::Revision;
use clap::Args;
#[derive(Args, Debug)]
pub(super) struct SimArgs {}
#[derive(Debug)]
pub(super) struct Dummy;
impl crate::cycle::CyclicDevice for Dummy {
    const OUTPUT_LEN: usize = 60;
    const INPUT_LEN: usize = 252;
    fn cycle(&mut self, _: crate::time::Instant, _: Option<&[u8]>, _: &mut [u8]) {}
}
pub(super) fn new(_: &SimArgs, _: Revision) -> Dummy {
    Dummy
}
