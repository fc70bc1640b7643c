#include "io/dicom_registration.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

#include "base/error.hpp"
#include "base/file.hpp"
#include "io/dicom_child.hpp"
#include "io/dicom_dataset.hpp"
#include "io/dicom_derivation.hpp"
#include "io/dicom_series.hpp"

namespace livetet {

namespace dicom {

namespace {

using gdcm::Tag;
using gdcm::VR;

constexpr const char* deformable_spatial_registration = "1.2.840.10008.5.1.4.1.1.66.3";

const Tag deformable_registration_sequence(0x0064, 0x0002),
    source_frame_of_reference_uid(0x0064, 0x0003),
    deformable_registration_grid_sequence(0x0064, 0x0005), grid_dimensions(0x0064, 0x0007),
    grid_resolution(0x0064, 0x0008), vector_grid_data(0x0064, 0x0009),
    pre_deformation_matrix_registration_sequence(0x0064, 0x000f),
    post_deformation_matrix_registration_sequence(0x0064, 0x0010),
    registration_type_code_sequence(0x0070, 0x030d), content_label(0x0070, 0x0080),
    content_description(0x0070, 0x0081), content_creator_name(0x0070, 0x0084),
    transformation_matrix_type(0x0070, 0x030c), transformation_matrix(0x3006, 0x00c6),
    transformation_comment(0x3006, 0x00c8);

/// Elements of patient, study and frame of reference. Those that every object has to have are empty
/// if the source does not state them.
struct Copied {
    Tag tag;
    VR vr;
    bool always;
};
const Copied of_study[] = {
    {{0x0008, 0x0005}, VR::CS, false},  // Specific Character Set
    {{0x0008, 0x0020}, VR::DA, true},   // Study Date
    {{0x0008, 0x0030}, VR::TM, true},   // Study Time
    {{0x0008, 0x0050}, VR::SH, true},   // Accession Number
    {{0x0008, 0x0090}, VR::PN, true},   // Referring Physician's Name
    {{0x0008, 0x0201}, VR::SH, false},  // Timezone Offset From UTC
    {{0x0008, 0x1030}, VR::LO, false},  // Study Description
    {{0x0010, 0x0010}, VR::PN, true},   // Patient's Name
    {{0x0010, 0x0020}, VR::LO, true},   // Patient ID
    {{0x0010, 0x0021}, VR::LO, false},  // Issuer of Patient ID
    {{0x0010, 0x0030}, VR::DA, true},   // Patient's Birth Date
    {{0x0010, 0x0040}, VR::CS, true},   // Patient's Sex
    {{0x0010, 0x1010}, VR::AS, false},  // Patient's Age
    {{0x0012, 0x0062}, VR::CS, false},  // Patient Identity Removed
    {{0x0012, 0x0063}, VR::LO, false},  // De-identification Method
    {{0x0020, 0x000d}, VR::UI, true},   // Study Instance UID
    {{0x0020, 0x0010}, VR::SH, true},   // Study ID
    {{0x0020, 0x0052}, VR::UI, true},   // Frame of Reference UID
    {{0x0020, 0x1040}, VR::LO, true},   // Position Reference Indicator
};

/// A UID of the source. Throws Error if it is missing.
std::string needed_uid(const Object& source, const Tag& tag, const char* what) {
    const std::string uid = text_of(source.header, tag);
    if (uid.empty())
        fail("{}: states no {} UID, expected one that a registration can refer to",
             source.file.string(), what);
    return uid;
}

gdcm::DataSet new_object(const Object& source, const DicomDerivation& derivation) {
    gdcm::DataSet set;
    for (const auto& [tag, vr, always] : of_study)
        if (const std::string text = text_of(source.header, tag); always || !text.empty())
            put_text(set, tag, vr, text);
    put_text(set, tag::sop_class_uid, VR::UI, deformable_spatial_registration);
    put_instance(set, new_series(source, derivation, 2000));
    put_text(set, tag::modality, VR::CS, "REG");
    put_text(set, tag::manufacturer, VR::LO, "Livetet");
    put_text(set, tag::manufacturer_model_name, VR::LO, "livetet warp");
    put_text(set, tag::device_serial_number, VR::LO, "none");
    put_text(set, tag::software_versions, VR::LO, derivation.version);
    put_text(set, tag::instance_number, VR::IS, "1");
    put_text(set, content_label, VR::CS, "DEFORMATION");
    put_text(set, content_description, VR::LO, "Displacement of soft tissue, deformed to rest");
    put_text(set, content_creator_name, VR::PN, "");
    return set;
}

gdcm::DataSet identity_matrix() {
    gdcm::DataSet item;
    const Eigen::Matrix4d identity = Eigen::Matrix4d::Identity();
    put_text(item, transformation_matrix, VR::DS, decimal_strings({identity.data(), 16}));
    put_text(item, transformation_matrix_type, VR::CS, "RIGID");
    return item;
}

/// Vectors as the standard orders them, X, Y and Z of each in turn, LPS, mm. `flipped`: the last
/// slice first.
std::vector<float> lps_vectors_mm(const Image<Eigen::Vector3f>& field, bool flipped) {
    const Eigen::Array3f lps_mm_from_metres_ras(-1e3F, -1e3F, 1e3F);
    std::vector<float> vectors;
    vectors.reserve(3 * field.values.size());
    const std::size_t slice = std::size_t(field.size[0]) * field.size[1];
    for (int k = 0; k < field.size[2]; ++k) {
        const Eigen::Vector3f* from =
            field.values.data() + slice * (flipped ? field.size[2] - 1 - k : k);
        for (std::size_t n = 0; n < slice; ++n) {
            const Eigen::Array3f v = lps_mm_from_metres_ras * from[n].array() + 0.0F;
            vectors.insert(vectors.end(), v.data(), v.data() + 3);
        }
    }
    return vectors;
}

gdcm::DataSet grid_item(const Image<Eigen::Vector3f>& field, const std::string& where) {
    const Eigen::Array3d lps_from_ras(-1, -1, 1);
    Eigen::Matrix3d axes = field.ras_from_voxel.topLeftCorner<3, 3>();  // metres
    axes = lps_from_ras.matrix().asDiagonal() * axes;
    const Eigen::Vector3d spacing_mm = 1e3 * axes.colwise().norm().transpose();
    const bool flipped = axes.determinant() < 0;
    const Eigen::Vector3d first = lps_mm(grid_of(field), flipped ? field.size[2] - 1 : 0);
    Eigen::Matrix<double, 3, 2> directions = axes.leftCols<2>().colwise().normalized();
    directions.array() += 0.0;  // no negative zero
    const std::uint32_t size[3] = {static_cast<std::uint32_t>(field.size[0]),
                                   static_cast<std::uint32_t>(field.size[1]),
                                   static_cast<std::uint32_t>(field.size[2])};
    const std::vector<float> vectors = lps_vectors_mm(field, flipped);
    const auto bytes = [](const auto* data, std::size_t count) {
        return std::span(reinterpret_cast<const char*>(data), count * sizeof *data);
    };
    gdcm::DataSet grid;
    put_text(grid, tag::image_position_patient, VR::DS, decimal_strings({first.data(), 3}));
    put_text(grid, tag::image_orientation_patient, VR::DS, decimal_strings({directions.data(), 6}));
    put_bytes(grid, grid_dimensions, VR::UL, bytes(size, 3), where);
    put_bytes(grid, grid_resolution, VR::FD, bytes(spacing_mm.data(), 3), where);
    put_bytes(grid, vector_grid_data, VR::OF, bytes(vectors.data(), vectors.size()), where);
    return grid;
}

/// An item of Deformable Registration Sequence: images that one transformation applies to.
gdcm::DataSet registration_of(const std::vector<DicomInstance>& images, const std::string& frame,
                              const std::string& comment) {
    std::vector<gdcm::DataSet> references;
    for (const DicomInstance& instance : images) references.push_back(reference_to(instance));
    gdcm::DataSet item;
    put_text(item, source_frame_of_reference_uid, VR::UI, frame);
    put_items(item, tag::referenced_image_sequence, references);
    put_text(item, transformation_comment, VR::LO, comment);
    put_items(item, registration_type_code_sequence, {});
    return item;
}

gdcm::DataSet registration(const std::vector<Object>& sources, const Image<Eigen::Vector3f>& field,
                           const DicomDerivation& derivation, const DerivedSeries& registered,
                           const std::string& where) {
    const Object& first = sources.front();
    needed_uid(first, tag::study_instance_uid, "Study Instance");
    const std::string frame = needed_uid(first, tag::frame_of_reference_uid, "Frame of Reference");
    std::vector<DicomInstance> of_source;
    for (const Object& object : sources) of_source.push_back(instance_of(object));

    gdcm::DataSet moved = registration_of(of_source, frame, "deformed to rest");
    put_items(moved, pre_deformation_matrix_registration_sequence, {identity_matrix()});
    put_items(moved, post_deformation_matrix_registration_sequence, {identity_matrix()});
    put_items(moved, deformable_registration_grid_sequence, {grid_item(field, where)});
    std::vector<gdcm::DataSet> items{moved};
    gdcm::DataSet set = new_object(first, derivation);
    add_references(set, {first.series_uid, of_source});
    if (!registered.instances.empty()) {
        items.push_back(registration_of(registered.instances, frame, "as registered"));
        add_references(set, {registered.series_uid, registered.instances});
    }
    put_items(set, deformable_registration_sequence, items);
    return set;
}

}  // namespace

}  // namespace dicom

void check_right_angles(const ImageGrid& grid, const std::string& where) {
    const Eigen::Matrix3d axes = grid.ras_from_voxel.topLeftCorner<3, 3>().colwise().normalized();
    constexpr double max_cosine = 1e-3;  // of rounded DICOM slices
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < a; ++b)
            if (const double cosine = axes.col(a).dot(axes.col(b)); std::abs(cosine) > max_cosine)
                fail(
                    "{}: its axes {} and {} are at {:.2f} degrees, expected right angles for a "
                    "registration object of DICOM",
                    where, "ijk"[b], "ijk"[a], 180 / std::numbers::pi * std::acos(cosine));
}

void write_dicom_registration(const std::filesystem::path& file, const DicomName& source,
                              const Image<Eigen::Vector3f>& field,
                              const DicomDerivation& derivation, const DerivedSeries& registered) {
    check_right_angles(grid_of(field), file.string());
    PendingFile pending(file);
    (void)through_gdcm(source.place, [&]() -> std::vector<char> {
        const std::vector<dicom::Object> sources = dicom::find_series(source);
        dicom::write_object(
            pending.path(), file,
            dicom::registration(sources, field, derivation, registered, file.string()),
            dicom::Syntax::explicit_types);
        return {};
    });
    pending.commit();
}

}  // namespace livetet
