//! A target written by hand: answers what a scanner asks, as a script says, and keeps what it saw.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddrV4, TcpListener, TcpStream, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use fieldarm::wire::enip::connection::{
    ConnectionRefusal, ForwardClose, ForwardOpen, ForwardOpenReply, Triad,
};
use fieldarm::wire::enip::cpf::Unconnected;
use fieldarm::wire::enip::encapsulation::{
    Command, EncapsulationStatus, Header, Packet, PacketWriter,
};
use fieldarm::wire::enip::io::IoFrame;
use fieldarm::wire::enip::message::{Request, Response, Service};
use fieldarm::wire::enip::status::GeneralStatus;

/// What a target does otherwise than it should.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Script {
    /// Extended status with which every Forward Open is refused.
    pub(crate) refuses: Option<u16>,
    /// Intervals that hold, whatever is requested, in us.
    pub(crate) apis_us: Option<(u32, u32)>,
    /// Sends no frames.
    pub(crate) is_mute: bool,
    /// Closes the stream as soon as the connection is open.
    pub(crate) hangs_up: bool,
}

/// What a target saw.
#[derive(Clone, Debug, Default)]
pub(crate) struct Seen {
    pub(crate) opened: u32,
    /// Forward Closes of the connection that was open.
    pub(crate) closed: u32,
    /// Streams that ended.
    pub(crate) ended: u32,
    /// Run flag and image of the latest frames, newest last.
    pub(crate) frames: Vec<(bool, Vec<u8>)>,
}

/// A running target; it ends when dropped.
pub(crate) struct Target {
    pub(crate) address: SocketAddrV4,
    seen: Arc<Mutex<Seen>>,
    input: Arc<Mutex<Vec<u8>>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// The open connection.
struct Connection {
    triad: Triad,
    t2o_id: u32,
    to: SocketAddrV4,
    interval: Duration,
    due: Instant,
    sequence: u32,
}

const O2T_ID: u32 = 0x1234_5678;

struct Life {
    script: Script,
    seen: Arc<Mutex<Seen>>,
    input: Arc<Mutex<Vec<u8>>>,
    udp: UdpSocket,
    connection: Option<Connection>,
}

impl Target {
    pub(crate) fn start(at: Ipv4Addr, script: Script) -> Self {
        let address = SocketAddrV4::new(at, 44_818);
        let listener = TcpListener::bind(address).unwrap();
        listener.set_nonblocking(true).unwrap();
        let udp = UdpSocket::bind((at, 2_222)).unwrap();
        udp.set_nonblocking(true).unwrap();
        let seen = Arc::new(Mutex::new(Seen::default()));
        let input = Arc::new(Mutex::new(vec![0; 252]));
        let stop = Arc::new(AtomicBool::new(false));
        let mut life = Life {
            script,
            seen: Arc::clone(&seen),
            input: Arc::clone(&input),
            udp,
            connection: None,
        };
        let stopped = Arc::clone(&stop);
        let thread = thread::spawn(move || {
            let mut streams: Vec<(TcpStream, Vec<u8>)> = Vec::new();
            while !stopped.load(Ordering::Relaxed) {
                if let Ok((stream, _)) = listener.accept() {
                    stream.set_nonblocking(true).unwrap();
                    streams.push((stream, Vec::new()));
                }
                streams.retain_mut(|(stream, arrived)| life.serve(stream, arrived));
                life.frames();
                thread::sleep(Duration::from_micros(300));
            }
        });
        Self { address, seen, input, stop, thread: Some(thread) }
    }

    pub(crate) fn seen(&self) -> Seen {
        self.seen.lock().unwrap().clone()
    }

    pub(crate) fn set_input(&self, bytes: &[u8]) {
        *self.input.lock().unwrap() = bytes.to_vec();
    }
}

impl Drop for Target {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let _ = self.thread.take().unwrap().join();
    }
}

impl Life {
    /// Serves one stream; false when it has ended.
    fn serve(&mut self, stream: &mut TcpStream, arrived: &mut Vec<u8>) -> bool {
        let mut room = [0; 2_048];
        match stream.read(&mut room) {
            Ok(len) if len > 0 => arrived.extend_from_slice(&room[..len]),
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => return true,
            _ => {
                self.seen.lock().unwrap().ended += 1;
                return false;
            }
        }
        while let Some((packet, len)) = Packet::from_stream(arrived) {
            let peer = stream.peer_addr().unwrap();
            let answer = self.answer(&packet, peer.ip());
            let was_open = self.seen.lock().unwrap().opened > 0;
            if let Some(answer) = answer {
                stream.write_all(&answer).unwrap();
            }
            arrived.drain(..len);
            if self.script.hangs_up && was_open {
                return false;
            }
        }
        true
    }

    fn answer(&mut self, packet: &Packet<'_>, peer: std::net::IpAddr) -> Option<Vec<u8>> {
        let mut header = packet.header.answer(EncapsulationStatus::SUCCESS);
        let mut room = [0; 2_048];
        match packet.header.command {
            Command::REGISTER_SESSION => {
                header.session = 77;
                let mut writer = PacketWriter::new(&mut room, header);
                writer.put(packet.data);
                let len = writer.finish().unwrap();
                Some(room[..len].to_vec())
            }
            Command::SEND_RR_DATA => {
                let unconnected = Unconnected::read(packet.data).unwrap();
                let request = Request::read(unconnected.message).unwrap();
                let port = unconnected.t2o_address.map_or(2_222, |address| address.port());
                let message = self.act(&request, peer, port);
                let mut writer = PacketWriter::new(&mut room, Header { ..header });
                Unconnected::new(&message).put(&mut writer);
                let len = writer.finish().unwrap();
                Some(room[..len].to_vec())
            }
            _ => None,
        }
    }

    fn act(&mut self, request: &Request<'_>, peer: std::net::IpAddr, port: u16) -> Vec<u8> {
        let mut data = [0; 256];
        let mut message = [0; 512];
        let additional;
        let response = match (request.service, self.script.refuses) {
            (Service::FORWARD_OPEN, Some(status)) => {
                let asked = ForwardOpen::read(request.data, false).unwrap();
                let refusal = ConnectionRefusal { triad: asked.triad, remaining_path_words: 0 };
                data[..10].copy_from_slice(&refusal.to_bytes());
                additional = status.to_le_bytes();
                Response {
                    service: request.service,
                    status: GeneralStatus::CONNECTION_FAILURE,
                    additional: &additional,
                    data: &data[..10],
                }
            }
            (Service::FORWARD_OPEN, None) => {
                let asked = ForwardOpen::read(request.data, false).unwrap();
                let apis = (asked.o2t_rpi_us, asked.t2o_rpi_us);
                let (o2t_api_us, t2o_api_us) = self.script.apis_us.unwrap_or(apis);
                let std::net::IpAddr::V4(peer) = peer else { unreachable!() };
                self.connection = Some(Connection {
                    triad: asked.triad,
                    t2o_id: asked.t2o_id,
                    to: SocketAddrV4::new(peer, port),
                    interval: Duration::from_micros(t2o_api_us.into()),
                    due: Instant::now(),
                    sequence: 0,
                });
                self.seen.lock().unwrap().opened += 1;
                let reply = ForwardOpenReply {
                    o2t_id: O2T_ID,
                    t2o_id: asked.t2o_id,
                    triad: asked.triad,
                    o2t_api_us,
                    t2o_api_us,
                    application: &[],
                };
                let len = reply.write(&mut data).unwrap();
                Response::success(request.service, &data[..len])
            }
            (Service::FORWARD_CLOSE, _) => {
                // Frames that were sent before count.
                self.frames();
                let asked = ForwardClose::read(request.data).unwrap();
                if self.connection.as_ref().is_some_and(|open| open.triad == asked.triad) {
                    self.connection = None;
                    self.seen.lock().unwrap().closed += 1;
                }
                let refusal = ConnectionRefusal { triad: asked.triad, remaining_path_words: 0 };
                data[..10].copy_from_slice(&refusal.to_bytes());
                Response::success(request.service, &data[..10])
            }
            (service, _) => Response::refusal(service, GeneralStatus::SERVICE_NOT_SUPPORTED),
        };
        let len = response.write(&mut message).unwrap();
        message[..len].to_vec()
    }

    fn frames(&mut self) {
        let mut room = [0; 2_048];
        while let Ok((len, _)) = self.udp.recv_from(&mut room) {
            let frame = IoFrame::read(&room[..len]).unwrap();
            if self.connection.is_none() || frame.connection_id != O2T_ID {
                continue;
            }
            let (run, image) = frame.split_run_idle().unwrap();
            let mut seen = self.seen.lock().unwrap();
            if seen.frames.len() == 1_000 {
                seen.frames.remove(0);
            }
            seen.frames.push((run, image.to_vec()));
        }
        let Some(open) = &mut self.connection else { return };
        if self.script.is_mute || Instant::now() < open.due {
            return;
        }
        open.due += open.interval;
        open.sequence += 1;
        let input = self.input.lock().unwrap().clone();
        let frame = IoFrame {
            connection_id: open.t2o_id,
            sequence: open.sequence,
            data_sequence: open.sequence as u16,
            data: &input,
        };
        let len = frame.write(None, &mut room).unwrap();
        let _ = self.udp.send_to(&room[..len], open.to);
    }
}
