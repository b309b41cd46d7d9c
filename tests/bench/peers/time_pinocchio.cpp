/*
 * Times Pinocchio: time_pinocchio values|times N_RFE [derivatives]. LEVEL names the compiler's options.
 *
 * Variants end in -turns-LEVEL (joints with one coordinate) or -euler-LEVEL (Euler angles). Springs and
 * dampers act as forces of the joints, and derivatives have their parts. Only the upper triangle of a mass
 * matrix is computed. Pinocchio differentiates along the axes of a joint. With Euler angles these turn with
 * the coordinates, so that its derivatives are not those by the coordinates; they are left out.
 */
#include <pinocchio/multibody.hpp>

#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/cholesky.hpp>
#include <pinocchio/algorithm/constrained-dynamics-derivatives.hpp>
#include <pinocchio/algorithm/constrained-dynamics.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/pv.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <vector>

#include "chain.hpp"
#include "timing.h"

using namespace pinocchio;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/* The chain at the state, and what its algorithms write. */
struct Subject {
    const bench &b;
    Model model;
    JointIndex tip;
    Data data;
    std::string kind;
    VectorXd stiffness, damping, q, qd, tau, qdd, forces;

    Subject(const bench &b, Chain chain, const char *kind)
        : b(b), model(chain.model), tip(chain.tip), data(model), kind(kind), stiffness(chain.stiffness),
          damping(chain.damping), q(Eigen::Map<VectorXd>(b.q, b.n)), qd(Eigen::Map<VectorXd>(b.qd, b.n)),
          tau(Eigen::Map<VectorXd>(b.tau, b.n)), qdd(Eigen::Map<VectorXd>(b.qdd, b.n)), forces(b.n) {
    }

    void apply_springs() {
        forces = tau - stiffness.cwiseProduct(q) - damping.cwiseProduct(qd);
    }

    template <class Function>
    void time(const char *quantity, const std::string &variant, Function function,
              std::vector<bench_result> results) {
        results.push_back({nullptr, 0});
        const auto repeat = [](void *subject, long times) {
            for (long i = 0; i < times; i++)
                (*static_cast<Function *>(subject))();
        };
        measure(&b, quantity, (variant + "-" + kind + "-" + LEVEL).c_str(), repeat, &function,
                results.data());
    }
};

static bench_result result(const MatrixXd &matrix) {
    return {matrix.data(), size_t(matrix.size())};
}
static bench_result result(const VectorXd &vector) {
    return {vector.data(), size_t(vector.size())};
}

static void time_accelerations(Subject &s) {
    s.time("accelerations", "aba",
           [&] {
               s.apply_springs();
               aba(s.model, s.data, s.q, s.qd, s.forces, Convention::LOCAL);
           },
           {result(s.data.ddq)});
    s.time("accelerations", "aba_world",
           [&] {
               s.apply_springs();
               aba(s.model, s.data, s.q, s.qd, s.forces, Convention::WORLD);
           },
           {result(s.data.ddq)});
    VectorXd solution(s.b.n);
    const auto dense = [&] {
        s.apply_springs();
        crba(s.model, s.data, s.q, Convention::WORLD);
        nonLinearEffects(s.model, s.data, s.q, s.qd);
        cholesky::decompose(s.model, s.data);
        solution = s.forces - s.data.nle;
        cholesky::solve(s.model, s.data, solution);
    };
    s.time("accelerations", "crba+cholesky", dense, {result(solution)});
}

using Contacts = std::vector<RigidConstraintModel, Eigen::aligned_allocator<RigidConstraintModel>>;
using ContactData = std::vector<RigidConstraintData, Eigen::aligned_allocator<RigidConstraintData>>;

/* The place where the tip is held. */
static SE3 place_of_tip(const Subject &s) {
    Data data(s.model);
    forwardKinematics(s.model, data, s.q);
    return SE3(Eigen::Matrix3d::Identity(), data.oMi[s.tip].translation());
}

static Contacts tip_contact(const Subject &s) {
    Contacts contacts;
    contacts.emplace_back(CONTACT_3D, s.model, s.tip, SE3::Identity(), 0, place_of_tip(s),
                          LOCAL_WORLD_ALIGNED);
    return contacts;
}

/* The tip is held where it is. */
static void time_rows(Subject &s) {
    Data data(s.model);
    const SE3 here = place_of_tip(s);
    const Contacts contacts = tip_contact(s);
    ContactData contact_data{RigidConstraintData(contacts[0])};
    initConstraintDynamics(s.model, data, contacts, contact_data);
    ProximalSettings settings(1e-12, 0., 1);
    s.time("rows", "constraintDynamics",
           [&] {
               s.apply_springs();
               constraintDynamics(s.model, data, s.q, s.qd, s.forces, contacts, contact_data, settings);
           },
           {result(data.ddq)});

    using Anchor = PointAnchorConstraintModelTpl<double, 0>;
    using AnchorData = PointAnchorConstraintDataTpl<double, 0>;
    Data pv_data(s.model);
    std::vector<Anchor, Eigen::aligned_allocator<Anchor>> anchors;
    std::vector<AnchorData, Eigen::aligned_allocator<AnchorData>> anchor_data;
    anchors.emplace_back(s.model, s.tip, SE3::Identity(), 0, here);
    anchor_data.emplace_back(anchors[0]);
    initPvSolver(s.model, pv_data, anchors);
    s.time("rows", "pv",
           [&] {
               s.apply_springs();
               pv(s.model, pv_data, s.q, s.qd, s.forces, anchors, anchor_data, settings);
           },
           {result(pv_data.ddq)});
}

/* Without weight, as Refdyn's h. */
static void time_mass(Subject &s) {
    Model weightless(s.model);
    weightless.gravity.setZero();
    s.time("mass", "crba+nle",
           [&] {
               crba(weightless, s.data, s.q, Convention::WORLD);
               nonLinearEffects(weightless, s.data, s.q, s.qd);
           },
           {result(s.data.M), result(s.data.nle)});
}

/* The forces beyond springs and dampers. */
static void time_inverse(Subject &s) {
    s.time("inverse", "rnea",
           [&] {
               rnea(s.model, s.data, s.q, s.qd, s.qdd);
               s.forces = s.data.tau + s.stiffness.cwiseProduct(s.q) + s.damping.cwiseProduct(s.qd);
           },
           {result(s.forces)});
}

static void time_derivatives(Subject &s) {
    const int n = s.b.n;
    MatrixXd by_q = MatrixXd::Zero(n, n), by_qd = by_q, by_last = by_q;
    s.time("d_accelerations", "computeABADerivatives",
           [&] {
               s.apply_springs();
               computeABADerivatives(s.model, s.data, s.q, s.qd, s.forces, by_q, by_qd, by_last);
               by_q.noalias() -= by_last * s.stiffness.asDiagonal();
               by_qd.noalias() -= by_last * s.damping.asDiagonal();
           },
           {result(by_q), result(by_qd)});
    by_q.setZero(), by_qd.setZero(), by_last.setZero();
    s.time("d_inverse", "computeRNEADerivatives",
           [&] {
               computeRNEADerivatives(s.model, s.data, s.q, s.qd, s.qdd, by_q, by_qd, by_last);
               by_q.diagonal() += s.stiffness;
               by_qd.diagonal() += s.damping;
           },
           {result(by_q), result(by_qd), result(by_last)});
}

static void time_row_derivatives(Subject &s) {
    const int n = s.b.n;
    Data data(s.model);
    const Contacts contacts = tip_contact(s);
    ContactData contact_data{RigidConstraintData(contacts[0])};
    initConstraintDynamics(s.model, data, contacts, contact_data);
    ProximalSettings settings(1e-12, 0., 1);
    MatrixXd by_q = MatrixXd::Zero(n, n), by_qd = by_q, by_forces = by_q;
    MatrixXd force_by_q = MatrixXd::Zero(3, n), force_by_qd = force_by_q, force_by_forces = force_by_q;
    s.time("d_rows", "computeConstraintDynamicsDerivatives",
           [&] {
               s.apply_springs();
               constraintDynamics(s.model, data, s.q, s.qd, s.forces, contacts, contact_data, settings);
               computeConstraintDynamicsDerivatives(s.model, data, contacts, contact_data, settings, by_q,
                                                    by_qd, by_forces, force_by_q, force_by_qd,
                                                    force_by_forces);
               by_q.noalias() -= by_forces * s.stiffness.asDiagonal();
               by_qd.noalias() -= by_forces * s.damping.asDiagonal();
           },
           {result(by_q), result(by_qd)});
}

static void time_functions(Subject &s) {
    time_accelerations(s);
    time_rows(s);
    time_mass(s);
    time_inverse(s);
}

int main(int argc, char **argv) {
    const bench b = open_bench("pinocchio", argc, argv);
    Subject turns(b, read_chain(b.n_rfe, false), "turns");
    time_derivatives(turns);
    time_row_derivatives(turns);
    if (argc > 3)
        return 0;
    time_functions(turns);
    if (b.n_rfe > 1) {
        Subject euler(b, read_chain(b.n_rfe, true), "euler");
        time_functions(euler);
    }
    return 0;
}
