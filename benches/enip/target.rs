//! Meters O->T: an adapter that does nothing but receive, and stamps each frame as it comes.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, SocketAddrV4, TcpListener, TcpStream, UdpSocket};
use std::time::{Duration, Instant};

use fieldarm::bus::enip::adapter::{Adapter, AdapterSettings, StreamId, Transmit};
use fieldarm::link::clock::MonotonicClock;
use fieldarm::wire::enip::{IO_PORT, MESSAGE_PORT};

use crate::Round;
use crate::gaps::Arrivals;
use crate::seed;

/// Longest wait for a frame before the TCP connections are looked at: nothing hurries there.
const LOOK_EVERY: Duration = Duration::from_millis(4);
/// Longest time to the first frame.
const PATIENCE: Duration = Duration::from_secs(20);

/// An adapter with its sockets.
pub(crate) struct Meter {
    adapter: Adapter,
    listener: TcpListener,
    streams: Vec<(StreamId, TcpStream)>,
    frames: UdpSocket,
    clock: MonotonicClock,
}

impl Meter {
    pub(crate) fn bind(here: Ipv4Addr, round: Round) -> io::Result<Self> {
        let settings = AdapterSettings {
            min_rpi: round.interval,
            rpi_step: Duration::from_micros(500),
            ..AdapterSettings::meca500()
        };
        let listener = TcpListener::bind(SocketAddrV4::new(here, MESSAGE_PORT))?;
        listener.set_nonblocking(true)?;
        let frames = UdpSocket::bind(SocketAddrV4::new(here, IO_PORT))?;
        frames.set_read_timeout(Some(LOOK_EVERY))?;
        Ok(Self {
            adapter: Adapter::new(settings, here, seed()),
            listener,
            streams: Vec::new(),
            frames,
            clock: MonotonicClock::new(),
        })
    }

    /// Lets a scanner own the adapter, and stamps its frames for a round.
    pub(crate) fn receive(mut self, round: Round) -> Result<Arrivals, String> {
        let mut arrivals = Arrivals::with_capacity(round.frames + 1);
        let mut left = round.warm_up;
        let mut buffer = [0; 1500];
        let mut deadline = Instant::now() + PATIENCE;
        while Instant::now() < deadline {
            match self.frames.recv_from(&mut buffer) {
                Ok((len, std::net::SocketAddr::V4(from))) => {
                    arrivals.stamp();
                    let now = self.clock.now();
                    self.adapter.handle_io_datagram(now, from, &buffer[..len]);
                    if left == round.warm_up {
                        deadline = Instant::now() + round.limit();
                    }
                    if left > 0 {
                        left -= 1;
                        if left == 0 {
                            arrivals.clear();
                        }
                    } else if arrivals.len() > round.frames {
                        return Ok(arrivals);
                    }
                }
                Ok(_) => {}
                Err(error) if is_nothing(&error) => {}
                Err(error) => return Err(error.to_string()),
            }
            self.look_at_streams().map_err(|error| error.to_string())?;
            self.transmit();
        }
        Err(format!("{} frames of {} in time", arrivals.len(), round.frames))
    }

    fn look_at_streams(&mut self) -> io::Result<()> {
        let now = self.clock.now();
        match self.listener.accept() {
            Ok((stream, std::net::SocketAddr::V4(peer))) => {
                stream.set_nonblocking(true)?;
                stream.set_nodelay(true)?;
                if let Some(id) = self.adapter.handle_accepted(now, peer) {
                    self.streams.push((id, stream));
                }
            }
            Ok(_) => {}
            Err(error) if is_nothing(&error) => {}
            Err(error) => return Err(error),
        }
        let mut buffer = [0; 1500];
        let adapter = &mut self.adapter;
        self.streams.retain_mut(|(id, stream)| match stream.read(&mut buffer) {
            Ok(0) => {
                adapter.handle_stream_closed(now, *id);
                false
            }
            Ok(len) => {
                adapter.handle_stream(now, *id, &buffer[..len]);
                true
            }
            Err(error) => is_nothing(&error),
        });
        Ok(())
    }

    fn transmit(&mut self) {
        let mut room = [0; 1500];
        let now = self.clock.now();
        self.adapter.handle_timeout(now);
        while let Some(transmit) = self.adapter.poll_transmit(now, &mut room) {
            match transmit {
                Transmit::Stream { stream, len } => {
                    let open = self.streams.iter_mut().find(|(id, _)| *id == stream);
                    if let Some((_, open)) = open {
                        let _ = open.write_all(&room[..len]);
                    }
                }
                Transmit::CloseStream { stream } => self.streams.retain(|(id, _)| *id != stream),
                Transmit::IoDatagram { to, len } => {
                    let _ = self.frames.send_to(&room[..len], to);
                }
                Transmit::MessageDatagram { .. } => {}
            }
        }
    }
}

/// Nothing is there yet.
fn is_nothing(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionRefused, Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), WouldBlock | TimedOut | Interrupted | ConnectionRefused)
}
