// The cameras of the made studio as sources of frames.
#pragma once

namespace render {

// Registers the scheme "made" with capture::open_camera. Call once at start-up.
//
//     made:plate?width=640&height=480&frames=60&samples=4&seed=1
//     made:probe?size=384&frames=180&samples=4&seed=1
//     made:gige_plate?width=640&height=480&rate=25&lag=2&loss=0&samples=4&seed=1
//     made:gige_probe?size=384&rate=75&lag=2&loss=10&samples=4&seed=1
//
// All settings are optional. `frames` are those that come before the end, 0 (the default) = without
// end; `samples` are the paths per pixel of the still pictures that all frames are made from when
// the camera is opened, which takes some seconds. Frame n is the same however often it is asked
// for: picture n of the camera, with its own noise and its own strength of the sun. Values are the
// sensor's codes, decoded by options.colour; the first frame's time is 0. options.response is not
// used: the codes follow the camera's transfer (made_studio.h). options.loop changes nothing.
//
// The last two are GigE Vision cameras of this process, read over packets by aravis: as time goes
// by (made_gige_camera.h): `lag` is how many frames pass until an exposure has effect, `loss` how
// many packets in a thousand are lost. Both have linear codes, BayerRG12.
void register_made_cameras();

}  // namespace render
