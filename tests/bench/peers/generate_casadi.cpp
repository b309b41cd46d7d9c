/*
 * C by CasADi from Pinocchio's algorithms: generate_casadi N_RFE... writes casadi/pinocchio_QUANTITY_N.c and
 * prints one JSON object a file. The Python packages of the two programs cannot be combined, their C++
 * headers can.
 */
#include <casadi/casadi.hpp>

#include <pinocchio/autodiff/casadi.hpp>
#include <pinocchio/multibody.hpp>

#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <cstdio>
#include <ctime>

#include "chain.hpp"

using casadi::SX;
using Model = pinocchio::ModelTpl<SX>;
using Data = pinocchio::DataTpl<SX>;
using Vector = Eigen::Matrix<SX, Eigen::Dynamic, 1>;

static Vector vector_of(const SX &column) {
    Vector made(column.size1());
    for (int i = 0; i < made.size(); i++)
        made[i] = column(i);
    return made;
}

static SX column_of(const Vector &vector) {
    SX made(vector.size(), 1);
    for (int i = 0; i < vector.size(); i++)
        made(i) = vector[i];
    return SX::densify(made);
}

/* From `begin`, CPU seconds. */
static void generate(const std::string &quantity, int n_rfe, const casadi::SXVector &in,
                     const casadi::SXVector &out, clock_t begin) {
    const std::string name = "pinocchio_" + quantity + "_" + std::to_string(n_rfe);
    casadi::CodeGenerator generator(name + ".c");
    generator.add(casadi::Function("f", in, out));
    generator.generate("casadi/");
    std::printf("{\"quantity\": \"%s\", \"variant\": \"pinocchio\", \"n_rfe\": %d, \"seconds\": %.3f}\n",
                quantity.c_str(), n_rfe, double(clock() - begin) / CLOCKS_PER_SEC);
}

int main(int argc, char **argv) {
    for (int i = 1; i < argc; i++) {
        const int n_rfe = std::atoi(argv[i]);
        const Chain chain = read_chain(n_rfe, false);
        const int n = chain.model.nv;
        clock_t begin = clock();
        Model model = chain.model.cast<SX>();
        Data data(model);
        const SX q = SX::sym("q", n), qd = SX::sym("qd", n), tau = SX::sym("tau", n);
        SX forces = tau;
        for (int k = 0; k < n; k++)
            forces(k) = tau(k) - chain.stiffness[k] * q(k) - chain.damping[k] * qd(k);
        pinocchio::aba(model, data, vector_of(q), vector_of(qd), vector_of(forces));
        generate("accelerations", n_rfe, {q, qd, tau}, {column_of(data.ddq)}, begin);

        begin = clock();
        model.gravity.setZero();
        Data other(model);
        pinocchio::crba(model, other, vector_of(q));
        pinocchio::nonLinearEffects(model, other, vector_of(q), vector_of(qd));
        Vector triangle(n * (n + 1) / 2);
        for (int column = 0, k = 0; column < n; column++)
            for (int row = 0; row <= column; row++)
                triangle[k++] = other.M(row, column);
        generate("mass", n_rfe, {q, qd, tau}, {column_of(triangle), column_of(other.nle)}, begin);
    }
    return 0;
}
