/*
 * The manipulator of models/N.txt as a model of Pinocchio. With `grouped`, the three turns of an element are
 * one joint with Euler angles, which Pinocchio computes faster than three joints, and less accurately for
 * long chains.
 */
#ifndef CHAIN_HPP
#define CHAIN_HPP

#include <pinocchio/multibody.hpp>

#include <fstream>
#include <stdexcept>
#include <string>

struct Chain {
    pinocchio::Model model;
    pinocchio::JointIndex tip = 0; /* the joint of the end-effector, whose origin is the tip */
    Eigen::VectorXd stiffness, damping;
};

inline pinocchio::JointIndex add_joint(pinocchio::Model &model, pinocchio::JointIndex parent, bool slides,
                                       int axis, const pinocchio::SE3 &placement, const std::string &name) {
    if (slides)
        return model.addJoint(parent, pinocchio::JointModelPZ(), placement, name);
    if (axis == 0)
        return model.addJoint(parent, pinocchio::JointModelRX(), placement, name);
    if (axis == 1)
        return model.addJoint(parent, pinocchio::JointModelRY(), placement, name);
    return model.addJoint(parent, pinocchio::JointModelRZ(), placement, name);
}

inline Chain read_chain(int n_rfe, bool grouped) {
    const std::string path = "models/" + std::to_string(n_rfe) + ".txt";
    std::ifstream file(path);
    Chain chain;
    int n = 0, slides = 0, axis = 0;
    double gravity = 0, mass = 0;
    pinocchio::SE3 group; /* the placement of the first of an element's turns */
    int waiting = 0;
    file >> n >> gravity;
    chain.model.gravity.linear() << 0, 0, -gravity;
    chain.stiffness.resize(n);
    chain.damping.resize(n);
    for (int i = 0; i < n; i++) {
        pinocchio::SE3 placement;
        Eigen::Vector3d place, center, moments;
        Eigen::Matrix3d turn;
        file >> slides >> axis;
        for (double &x : place)
            file >> x;
        for (int k = 0; k < 9; k++)
            file >> turn(k / 3, k % 3);
        file >> mass;
        for (double &x : center)
            file >> x;
        for (double &x : moments)
            file >> x;
        file >> chain.stiffness[i] >> chain.damping[i];
        placement.translation(place);
        placement.rotation(turn);
        if (waiting == 0)
            group = placement;
        waiting++;
        const std::string name = "joint" + std::to_string(i);
        if (!grouped)
            chain.tip = add_joint(chain.model, chain.tip, slides != 0, axis, placement, name);
        else if (mass > 0 && waiting == 3)
            chain.tip = chain.model.addJoint(chain.tip, pinocchio::JointModelSphericalZYX(), group, name);
        else if (mass > 0)
            chain.tip = add_joint(chain.model, chain.tip, slides != 0, axis, placement, name);
        if (mass > 0) {
            const pinocchio::Symmetric3 inertia(Eigen::Matrix3d(moments.asDiagonal()));
            chain.model.appendBodyToJoint(chain.tip, pinocchio::Inertia(mass, center, inertia),
                                          pinocchio::SE3::Identity());
            waiting = 0;
        }
    }
    if (!file)
        throw std::runtime_error(path + ": too few numbers");
    return chain;
}

#endif
