#pragma once

#include "simulation/random.hpp"
#include "simulation/recording.hpp"

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace octosurf::simulation {

/// What a consumer depth camera (structured light or active stereo) makes of true depths: the model of
/// `--sensor depth-real`.
///
/// 1. Depth is measured as disparity f·b/z, which comes in steps of 1/8 px.
/// 2. The deviation of a reading, its step included, is axial_sigma(); the noise is averaged over the
///    matching window, hence correlated between neighbours: (1 − |Δx|/9)(1 − |Δy|/9).
/// 3. Across outlines a pixel reads what lies lateral_sigma() pixels beside it; where its place falls
///    between foreground and background it reads a mixture of both, a *flying pixel*: one for each
///    pixel of an upright or level outline's length, on average. Flying pixels have label 0.
/// 4. There is no reading at grazing incidence nor where too little light comes back: drop_out().
/// 5. A bias of disparity that varies slowly over the image is the camera's own: the same in all scans.
/// The shadow beside an object that the projector cannot reach is not modelled.
///
/// Figures come from
/// [B] Barron and Malik, Intrinsic scene properties from a single RGB-D image, CVPR 2013, and Handa, Whelan,
///     McDonald and Davison, A benchmark for RGB-D visual odometry, 3D reconstruction and SLAM, ICRA 2014;
/// [C] Clarkson et al., Distortion correction of depth data from consumer depth cameras, 3DBST 2013;
/// [I] Grunnet-Jepsen, Sweetser and Woodfill, Best-known-methods for tuning Intel RealSense D400 depth
/// cameras; [K] Khoshelham and Elberink, Accuracy and resolution of Kinect depth data for indoor mapping
///     applications, Sensors 12(2), 2012;
/// [M] Konolige and Mihelich, Technical description of Kinect calibration, ROS, 2012;
/// [N] Nguyen, Izadi and Lovell, Modeling Kinect sensor noise for improved 3D reconstruction and tracking,
///     3DIMPVT 2012;
/// [T] Teichman, Miller and Thrun, Unsupervised intrinsic calibration of depth sensors via SLAM, RSS 2013.
class RealCamera {
 public:
  /// m: from projector to camera [K, M]; a D435's is 0.05 [I].
  static constexpr double baseline = 0.075;
  /// px [B, M]: 13 mm at 2 m, 2 mm less in [B], whose pixels are finer.
  static constexpr double disparity_step = 1.0 / 8;
  /// px: the Kinect correlates windows of 9 × 9 or 9 × 7 pixels [M].
  static constexpr std::size_t matching_window = 9;
  /// px of disparity, over the image: 3 mm at 2 m. Cameras differ, and their bias varies slowly and grows
  /// with the distance [T]; a plane is off by some 3 mm even when that was corrected [C].
  static constexpr double bias_rms = 0.03;
  /// Albedos from black cloth (0.04) to white paint (0.9); how many are dark is chosen, not published.
  static constexpr std::array face_albedo{0.1, 0.9};  ///< of a face, uniform between them
  static constexpr double dark_albedo = 0.04;         ///< of its dark patches
  static constexpr double dark_patch_share = 0.03;    ///< of all patches
  static constexpr double dark_patch = 0.2;           ///< m: edge of a patch

  /// A camera with its own bias in a world with its own albedos. `noise_scale` is a factor on noise,
  /// lateral noise and bias; steps and drop-outs remain.
  RealCamera(Random bias, Random albedo, double noise_scale);

  /// m: deviation of a reading of depth z, the disparity steps included [N]: 6 mm at 2 m, as in [K];
  /// 0.06 px of disparity, where [I] finds 0.08 in a D435.
  static double axial_sigma(double z, double incidence_rad);
  /// px: deviation of an outline's place in the image, along each axis [N].
  static double lateral_sigma(double incidence_rad);
  /// Probability that there is no reading.
  static double drop_out(double z, double incidence_rad, double albedo);
  /// px of disparity, at an image point in pixels.
  double bias(double x, double y) const;
  /// Of a face at the point uv of its plane; face 0 stands for all curved things.
  double albedo(std::uint16_t face, const Eigen::Vector2d& uv) const;

  /// Takes out readings by drop_out(), in patches of the matching window's size. One albedo a pixel.
  void drop(std::span<const double> albedos, Random random, Readings& readings) const;
  /// Outlines, noise, bias and steps. Depths are not rounded further, nor cut off at the camera's reach.
  Readings measured(const Readings& ideal, Random random) const;

 private:
  Readings seen_beside(const Readings& ideal, Random& random) const;

  std::array<double, 5> bias_coefficients_{};
  std::uint64_t albedo_seed_;
  double noise_scale_;
};

/// White noise averaged over a square window, its variance restored: standard normal at each pixel,
/// correlation (1 − |Δx|/window)(1 − |Δy|/window), 0 beyond. Row by row. O(window) a pixel.
std::vector<double> correlated_noise(std::size_t width, std::size_t height, std::size_t window,
                                     Random& random);

}  // namespace octosurf::simulation
