#pragma once

#include <string>
#include <string_view>

// Written by idl/type_hashes.py.

namespace octosurf::dds {

/// RIHS01 of a type as ROS names it, "sensor_msgs/msg/Image"; empty: not known.
inline std::string_view type_hash(const std::string& type) {
  struct Entry {
    std::string_view type, hash;
  };
  static constexpr Entry all[] = {
      {"convex_plane_decomposition_msgs/msg/PlanarTerrain",
       "RIHS01_99aee1c3ff6087f377e927f40eb25509760eba180f3cfcc7f479b7c49b23d2dd"},
      {"grid_map_msgs/msg/GridMap",
       "RIHS01_343b0e72887541beda6b035cc053f2d6fffaad9d6dcb2773c15a808dfca31fde"},
      {"octomap_msgs/msg/Octomap", "RIHS01_9891a19a05b70ec20aa8f45db3f8300b9ab80afff32c61c549d25087da9625b0"},
      {"octosurf_msgs/msg/Stairs", "RIHS01_7380cf8d28607f06138b51736528eef0593bc8ad69ef1b9250037a043ff04729"},
      {"octosurf_msgs/msg/Status", "RIHS01_caec836f319343b77aa2bc0959e04eef4f7f90218b7a290640816aecf8d4654c"},
      {"octosurf_msgs/msg/Surfaces",
       "RIHS01_1234aac2b340a7b7cff70872cfc4c1633ceb57ed6835ea76c6d0302acee11525"},
      {"octosurf_msgs/srv/Changes_Request",
       "RIHS01_b3c8c652e3aa4025776689b46b9403e84991e29deba0e25d16b19e4999df1bed"},
      {"octosurf_msgs/srv/Changes_Response",
       "RIHS01_cfb4c825650816d1de13df50c0840c13b3e4c0d20313607fa6f3a53bad51dd50"},
      {"octosurf_msgs/srv/Clear_Request",
       "RIHS01_2f4ddda6e73ba915ada13a3a4cf75df75df0ba04cd9f0fa9d94a5f131d3949be"},
      {"octosurf_msgs/srv/Clear_Response",
       "RIHS01_0b018151a3dcd2b8c3b4d89d5ec0e2dfa010ef634f7829d553d28dde65eee8ca"},
      {"octosurf_msgs/srv/ContactRegions_Request",
       "RIHS01_8cff7c7c36c80eecaad55ca66b611e006dff6ea627ba11952179b035990ab52d"},
      {"octosurf_msgs/srv/ContactRegions_Response",
       "RIHS01_5390f588367fb20b017a88ccaa82df1f17f77fe14ba41f30eb94aa681e5083bb"},
      {"octosurf_msgs/srv/Load_Request",
       "RIHS01_a79ddf67be02b7a48c3825d41e258b0759b26e97146f47d11cb51561d1117078"},
      {"octosurf_msgs/srv/Load_Response",
       "RIHS01_fcdf61ed8447c43860a797d686421f44c3353a710a7e82f0b88b2322467f51a8"},
      {"octosurf_msgs/srv/Plan_Request",
       "RIHS01_f4f675ae9bc391f83f1a472dcf83784c61e22fe5cacc1ff3afac728bdfd6e7db"},
      {"octosurf_msgs/srv/Plan_Response",
       "RIHS01_54905cbde15e64df1c764e2571daf9771632b1f3e61c39a080a2a0fff309f17b"},
      {"octosurf_msgs/srv/Publish_Request",
       "RIHS01_47ef5b285883d3481fd17f60a9452d2fa749f5e2b8abc4575b682cb08ec62e27"},
      {"octosurf_msgs/srv/Publish_Response",
       "RIHS01_e687f985951997575e4143113dc3c19f77b45cde79b631d3c19d6565746729b1"},
      {"octosurf_msgs/srv/Query_Request",
       "RIHS01_8c98bee5710f6016c6212714d0c7d1aee6f093c9b63052e9a91a61da85d1d4c1"},
      {"octosurf_msgs/srv/Query_Response",
       "RIHS01_0408ce4edcb2a8b4873d13b4dcc60c804f5e08339d363b8447561c3f0f6c5aae"},
      {"octosurf_msgs/srv/Save_Request",
       "RIHS01_944a676089ba19139939b3269f097369b1c7255ae64ad26498a4d3ee02b1abe8"},
      {"octosurf_msgs/srv/Save_Response",
       "RIHS01_c96d12d2e353f5a9421b768d23957aa9a50f4777e38513d63e1a8d7508d03f18"},
      {"rmw_dds_common/msg/ParticipantEntitiesInfo",
       "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e"},
      {"sensor_msgs/msg/CameraInfo",
       "RIHS01_b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"},
      {"sensor_msgs/msg/Image", "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"},
      {"sensor_msgs/msg/PointCloud2",
       "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"},
      {"std_msgs/msg/Float32MultiArray",
       "RIHS01_0599f6f85b4bfca379873a0b4375a0aca022156bd2d7021275d116ed1fa8bfe0"},
      {"tf2_msgs/msg/TFMessage", "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
      {"visualization_msgs/msg/MarkerArray",
       "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"},
  };
  for (const Entry& entry : all)
    if (entry.type == type) return entry.hash;
  return {};
}

}  // namespace octosurf::dds
