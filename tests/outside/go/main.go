// A client of partiemc.v1 in Go, from proto/PROTOCOL.md and the .proto alone.
//
// usage: zstd -dc RECORDING.pemc | client ADDRESS
//
// Reads a header and frames, each after its length (client/recordings/README.md), and streams them.
// Prints the digests of every frame.
package main

import (
	"bufio"
	"context"
	"encoding/binary"
	"errors"
	"fmt"
	"io"
	"log"
	"math"
	"os"
	"time"

	"google.golang.org/grpc"
	"google.golang.org/grpc/credentials/insecure"
	"google.golang.org/protobuf/encoding/protowire"
	"google.golang.org/protobuf/proto"

	partiemc "outside/contract/partiemc/v1"
)

func readMessage(in *bufio.Reader) ([]byte, error) {
	size, err := binary.ReadUvarint(in)
	if err != nil {
		return nil, err
	}
	message := make([]byte, size)
	_, err = io.ReadFull(in, message)
	return message, err
}

// Returns the spacing of a RecordingHeader: its field 1, a double.
func spacingOf(header []byte) (float64, error) {
	number, kind, tag := protowire.ConsumeTag(header)
	if number != 1 || kind != protowire.Fixed64Type {
		return 0, errors.New("the recording has no spacing")
	}
	bits, length := protowire.ConsumeFixed64(header[tag:])
	if length < 0 {
		return 0, protowire.ParseError(length)
	}
	return math.Float64frombits(bits), nil
}

// Receives one answer and prints its digests.
func receive(stream partiemc.ReconstructionService_ReconstructClient, sequence uint64) error {
	for {
		response, err := stream.Recv()
		if err != nil {
			return err
		}
		if response.GetNotice() != nil {
			continue
		}
		frame := response.GetFrame()
		if frame == nil || frame.Sequence != sequence {
			return fmt.Errorf("frame %d: answered by %v", sequence, response)
		}
		fmt.Printf("%016x %016x\n", frame.RingsDigest, frame.MeshDigest)
		return nil
	}
}

func run(address string, in *bufio.Reader) error {
	header, err := readMessage(in)
	if err != nil {
		return err
	}
	spacing, err := spacingOf(header)
	if err != nil {
		return err
	}
	connection, err := grpc.NewClient(address,
		grpc.WithTransportCredentials(insecure.NewCredentials()),
		grpc.WithDefaultCallOptions(grpc.MaxCallRecvMsgSize(math.MaxInt32)))
	if err != nil {
		return err
	}
	defer connection.Close()
	deadline, cancel := context.WithTimeout(context.Background(), time.Minute)
	defer cancel()
	stream, err := partiemc.NewReconstructionServiceClient(connection).Reconstruct(deadline)
	if err != nil {
		return err
	}
	open := &partiemc.OpenStream{Parameters: &partiemc.ReconstructionParameters{Spacing: &spacing}}
	err = stream.Send(&partiemc.ReconstructRequest{
		Request: &partiemc.ReconstructRequest_Open{Open: open}})
	if err != nil {
		return err
	}
	response, err := stream.Recv()
	if err != nil {
		return err
	}
	window := uint64(response.GetOpened().GetFramesInFlight())

	sent, answered := uint64(0), uint64(0)
	for {
		message, err := readMessage(in)
		if err == io.EOF {
			break
		}
		frame := &partiemc.ParticleFrame{}
		if err == nil {
			err = proto.Unmarshal(message, frame)
		}
		if err == nil && sent-answered == window {
			answered++
			err = receive(stream, answered)
		}
		if err != nil {
			return err
		}
		sent++
		frame.Sequence = sent
		err = stream.Send(&partiemc.ReconstructRequest{
			Request: &partiemc.ReconstructRequest_Frame{Frame: frame}})
		if err != nil {
			return err
		}
	}
	if err := stream.CloseSend(); err != nil {
		return err
	}
	for answered < sent {
		answered++
		if err := receive(stream, answered); err != nil {
			return err
		}
	}
	if _, err := stream.Recv(); err != io.EOF {
		return fmt.Errorf("the stream does not end: %v", err)
	}
	return nil
}

func main() {
	if len(os.Args) != 2 {
		log.Fatal("usage: zstd -dc RECORDING.pemc | client ADDRESS")
	}
	if err := run(os.Args[1], bufio.NewReader(os.Stdin)); err != nil {
		log.Fatal(err)
	}
}
