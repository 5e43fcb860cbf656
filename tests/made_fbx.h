// Binary FBX, version 7.4, for tests: Debian's assimp writes some that nobody reads.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "render/mesh.h"

namespace made {

// A record of the file: values already as bytes, and records below it.
struct FbxNode {
  std::string name;
  std::string values = {};
  std::uint32_t value_count = 0;
  std::vector<FbxNode> nodes = {};

  template <class T>
  static void put(std::string& bytes, T value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  FbxNode& text(const std::string& value) {
    values += 'S', put(values, static_cast<std::uint32_t>(value.size())), values += value;
    ++value_count;
    return *this;
  }
  FbxNode& number(std::int32_t value) { return values += 'I', add(value); }
  FbxNode& id(std::int64_t value) { return values += 'L', add(value); }
  FbxNode& real(double value) { return values += 'D', add(value); }
  FbxNode& reals(const std::vector<double>& all) { return values += 'd', add_all(all); }
  FbxNode& numbers(const std::vector<std::int32_t>& all) { return values += 'i', add_all(all); }
  FbxNode& with(FbxNode node) {
    nodes.push_back(std::move(node));
    return *this;
  }

  void write(std::string& file) const {
    const std::size_t begin = file.size();
    constexpr std::size_t head = 13;
    file.append(head - 1, '\0');
    file += static_cast<char>(name.size());
    file += name + values;
    for (const FbxNode& node : nodes) node.write(file);
    if (!nodes.empty()) file.append(head, '\0');
    std::string offsets;
    put(offsets, static_cast<std::uint32_t>(file.size()));
    put(offsets, value_count);
    put(offsets, static_cast<std::uint32_t>(values.size()));
    file.replace(begin, offsets.size(), offsets);
  }

 private:
  template <class T>
  FbxNode& add(T value) {
    put(values, value);
    ++value_count;
    return *this;
  }
  template <class T>
  FbxNode& add_all(const std::vector<T>& all) {
    put(values, static_cast<std::uint32_t>(all.size()));
    put(values, std::uint32_t{0});  // not compressed
    put(values, static_cast<std::uint32_t>(all.size() * sizeof(T)));
    for (const T value : all) put(values, value);
    ++value_count;
    return *this;
  }
};

struct FbxPart {
  std::string name;
  render::Mesh mesh;  // with normals and texture coordinates, v down
  std::vector<double> colour;
  std::string picture;  // file; "" = none
  double visibility = 1;
};

inline FbxNode fbx_geometry(const FbxPart& part, std::int64_t id) {
  std::vector<double> points, normals, uvs, colours;
  std::vector<std::int32_t> corners;
  for (const auto& p : part.mesh.positions) points.insert(points.end(), {p.x, p.y, p.z});
  for (const auto& triangle : part.mesh.triangles) {
    for (const std::uint32_t corner : triangle) {
      corners.push_back(static_cast<std::int32_t>(corner));
      const auto& n = part.mesh.normals[corner];
      normals.insert(normals.end(), {n.x, n.y, n.z});
      uvs.insert(uvs.end(), {part.mesh.uvs[corner][0], 1 - part.mesh.uvs[corner][1]});
      if (part.mesh.colours.empty()) continue;
      const auto& [r, g, b] = part.mesh.colours[corner];
      colours.insert(colours.end(), {r / 255.0, g / 255.0, b / 255.0, 1});
    }
    corners.back() = -corners.back() - 1;  // the polygon's last
  }
  FbxNode layer{"Layer"};
  layer.number(0);
  const auto element = [&](const std::string& kind, const char* mapping, const char* reference) {
    layer.with(FbxNode{"LayerElement"}
                   .with(FbxNode{"Type"}.text("LayerElement" + kind))
                   .with(FbxNode{"TypedIndex"}.number(0)));
    return FbxNode{"LayerElement" + kind}
        .number(0)
        .with(FbxNode{"MappingInformationType"}.text(mapping))
        .with(FbxNode{"ReferenceInformationType"}.text(reference));
  };
  FbxNode geometry{"Geometry"};
  if (!colours.empty()) {
    geometry.with(
        element("Color", "ByPolygonVertex", "Direct").with(FbxNode{"Colors"}.reals(colours)));
  }
  return geometry.id(id)
      .text(part.name + std::string("\0\1", 2) + "Geometry")
      .text("Mesh")
      .with(FbxNode{"Vertices"}.reals(points))
      .with(FbxNode{"PolygonVertexIndex"}.numbers(corners))
      .with(element("Normal", "ByPolygonVertex", "Direct").with(FbxNode{"Normals"}.reals(normals)))
      .with(element("UV", "ByPolygonVertex", "Direct").with(FbxNode{"UV"}.reals(uvs)))
      .with(element("Material", "AllSame", "IndexToDirect").with(FbxNode{"Materials"}.numbers({0})))
      .with(layer);
}

// Y up, the unit a centimetre.
inline std::string made_fbx(const std::vector<FbxPart>& parts) {
  const std::string mark("\0\1", 2);
  FbxNode objects{"Objects"}, connections{"Connections"};
  const auto connect = [&](std::int64_t child, std::int64_t parent) {
    connections.with(FbxNode{"C"}.text("OO").id(child).id(parent));
  };
  std::int64_t id = 1000;
  for (const FbxPart& part : parts) {
    const std::int64_t geometry = ++id, model = ++id, material = ++id, texture = ++id;
    objects.with(fbx_geometry(part, geometry));
    FbxNode visibility{"P"};
    visibility.text("Visibility").text("Visibility").text("").text("A").real(part.visibility);
    objects.with(FbxNode{"Model"}
                     .id(model)
                     .text(part.name + mark + "Model")
                     .text("Mesh")
                     .with(FbxNode{"Version"}.number(232))
                     .with(FbxNode{"Properties70"}.with(visibility)));
    FbxNode colour{"P"};
    colour.text("DiffuseColor").text("Color").text("").text("A");
    for (const double value : part.colour) colour.real(value);
    objects.with(FbxNode{"Material"}
                     .id(material)
                     .text(part.name + mark + "Material")
                     .text("")
                     .with(FbxNode{"ShadingModel"}.text("lambert"))
                     .with(FbxNode{"Properties70"}.with(colour)));
    connect(model, 0), connect(geometry, model), connect(material, model);
    if (part.picture.empty()) continue;
    objects.with(FbxNode{"Texture"}
                     .id(texture)
                     .text(part.name + mark + "Texture")
                     .text("")
                     .with(FbxNode{"FileName"}.text(part.picture))
                     .with(FbxNode{"RelativeFilename"}.text(part.picture)));
    connections.with(FbxNode{"C"}.text("OP").id(texture).id(material).text("DiffuseColor"));
  }
  FbxNode up{"P"}, unit{"P"};
  up.text("UpAxis").text("int").text("Integer").text("").number(1);
  unit.text("UnitScaleFactor").text("double").text("Number").text("").real(1);
  constexpr std::int32_t version = 7400;
  std::string file = std::string("Kaydara FBX Binary  \0\x1a\0", 23);
  FbxNode::put(file, version);
  FbxNode{"FBXHeaderExtension"}.with(FbxNode{"FBXVersion"}.number(version)).write(file);
  FbxNode{"GlobalSettings"}.with(FbxNode{"Properties70"}.with(up).with(unit)).write(file);
  objects.write(file);
  connections.write(file);
  return file + std::string(13, '\0');
}

// An ascii file of one triangle with the corners (0, 0, 0), (1, 0, 0), (1, 2, 3), its unit a metre.
inline std::string ascii_fbx(const std::string& settings,
                             const std::string& of_model = "",
                             const std::string& objects = "",
                             const std::string& connections = "") {
  return "; FBX 7.3.0 project file\nFBXHeaderExtension:  {\nFBXVersion: 7300\n}\n"
         "GlobalSettings:  {\nVersion: 1000\nProperties70:  {\n"
         "P: \"UnitScaleFactor\", \"double\", \"Number\", \"\",100\n" +
         settings +
         "}\n}\nObjects:  {\nGeometry: 1, \"Geometry::\", \"Mesh\" {\n"
         "Vertices: *9 {\na: 0,0,0,1,0,0,1,2,3\n}\nPolygonVertexIndex: *3 {\na: 0,1,-3\n}\n"
         "GeometryVersion: 124\n}\nModel: 2, \"Model::part\", \"Mesh\" {\nVersion: 232\n"
         "Properties70:  {\n" +
         of_model + "}\n}\n" + objects + "}\nConnections:  {\nC: \"OO\",2,0\nC: \"OO\",1,2\n" +
         connections + "}\n";
}

}  // namespace made
