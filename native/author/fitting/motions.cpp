// SPDX-License-Identifier: MIT
// Motions of all joints for given weights. One sparse system serves all expressions, because joints
// turn little. Its right side takes the present rotations into account exactly, so that the
// iteration ends at the optimum although the matrix ignores them.
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>

#include "author/fitting/problem.h"
#include "author/fitting/weights_by_joint.h"
#include "core/parallel_for.h"

namespace risorius::author::detail {

namespace {

using Mat6 = Eigen::Matrix<double, 6, 6>;
using Vec6 = Eigen::Matrix<double, 6, 1>;

/// Number of ranges into which the work is split for the threads. Costs of joints and expressions
/// differ: a given joint costs nothing, and an expression that rotates joints far costs as much as
/// ten others.
constexpr std::size_t kRanges = 16;
constexpr double kFar = 0.25;  // radians: from this angle on, the turned arms are used
// Regularisation of rotations (kTurn) and of translations (kShift), as shares of the joints' mean
// stiffness. It keeps joints that share vertices from turning against each other. Values from 1e-4
// to 10 were tried on a head with 52 expressions and on four other heads.
constexpr double kTurn = 0.03;
constexpr double kShift = 3e-3;
// Conjugate gradients stop when their residual energy falls to this share of its first value. With
// a share of 1e-2, some rounds made the fit worse.
constexpr double kEnough = 1e-6;
constexpr double kTurnAtPivot = 0.01;  // at a pivot a joint should turn and not shift
constexpr double kShiftAtPivot = 0.01;

Mat3 cross_matrix(const Vec3& a) {
  Mat3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// Sums of s, s v and s v v^T over the vertices v that two joints share. s is the importance of the
/// vertex times its weight of one joint times its weight of the other.
struct Moments {
  double zeroth = 0.0;
  Vec3 first = Vec3::Zero();
  Mat3 second = Mat3::Zero();

  void add(double s, const Vec3& v) {
    zeroth += s;
    first += s * v;
    second.noalias() += (s * v) * v.transpose();
  }
};

/// Sums over the vertices v that two joints share, weighted as in Moments. The arms p = v - a and
/// q = v - b go from the positions a and b of the two joints.
struct Shared {
  int column = 0;  // of the other joint
  std::uint32_t joint = 0;
  double mass = 0.0;
  Mat3 qp = Mat3::Zero();  // sum of q p^T
  Vec3 p = Vec3::Zero(), q = Vec3::Zero();
};

Shared share(const Moments& m, const Vec3& a, const Vec3& b) {
  Shared out;
  out.mass = m.zeroth;
  out.qp =
      m.second - m.first * a.transpose() - b * m.first.transpose() + m.zeroth * b * a.transpose();
  out.p = m.first - m.zeroth * a;
  out.q = m.first - m.zeroth * b;
  return out;
}

/// The 6 x 6 block of the stiffness matrix that couples two joints.
/// In: s            sums with the arms in the neutral pose
///     turn, other  present rotations of the two joints
Mat6 block(const Shared& s, const Mat3& turn, const Mat3& other) {
  const Mat3 qp = other * s.qp * turn.transpose();
  Mat6 out;
  out.topLeftCorner<3, 3>() = qp.trace() * Mat3::Identity() - qp;
  out.topRightCorner<3, 3>() = cross_matrix(turn * s.p);
  out.bottomLeftCorner<3, 3>() = -cross_matrix(other * s.q);
  out.bottomRightCorner<3, 3>() = s.mass * Mat3::Identity();
  return out;
}

using Sparse = Eigen::SparseMatrix<double>;

/// Factors a symmetric matrix once and solves with it. A small matrix is factored as a dense
/// matrix, because that is faster.
class Factor {
 public:
  void compute(const Sparse& lower) {
    dense_ = lower.rows() <= kDense;
    if (dense_) {
      full_.compute(Eigen::MatrixXd(lower));
    } else {
      thin_.compute(lower);
    }
  }
  Eigen::VectorXd solve(const Eigen::VectorXd& right) const {
    return dense_ ? Eigen::VectorXd(full_.solve(right)) : Eigen::VectorXd(thin_.solve(right));
  }

 private:
  static constexpr Eigen::Index kDense = 1500;
  bool dense_ = false;
  Eigen::LLT<Eigen::MatrixXd> full_;
  Eigen::SimplicialLLT<Sparse> thin_;
};

class System {
 public:
  System(const Problem& problem, const State& state, const ByJoint& weights)
      : column_(state.joints.size(), -1), rows_(state.joints.size()) {
    int n = 0;
    for (std::size_t j = 0; j < state.joints.size(); ++j) {
      if (state.joints[j].given) continue;
      column_[j] = n++;
      at_pivot_.push_back(state.joints[j].position != state.joints[j].place);
    }
    size_ = 6 * n;
    core::parallel_for(
        state.joints.size(), problem.threads,
        [&](std::size_t from, std::size_t to) {
          std::vector<Moments> sums(state.joints.size());
          std::vector<bool> met(state.joints.size());
          std::vector<std::uint32_t> partners;
          for (std::size_t j = from; j < to; ++j) {
            if (column_[j] < 0) continue;
            for (const auto& entry : weights.of[j]) {
              const double s = problem.importance[entry.vertex] * entry.weight;
              for (const Influence& other : state.weights[entry.vertex]) {
                if (other.joint < j || column_[other.joint] < 0) continue;
                if (!met[other.joint]) {
                  met[other.joint] = true;
                  partners.push_back(other.joint);
                }
                sums[other.joint].add(s * other.weight, problem.positions[entry.vertex]);
              }
            }
            std::sort(partners.begin(), partners.end());
            for (const std::uint32_t k : partners) {
              Shared s = share(sums[k], state.joints[j].position, state.joints[k].position);
              s.column = column_[k];
              s.joint = k;
              rows_[j].push_back(s);
              sums[k] = {};
              met[k] = false;
            }
            partners.clear();
          }
        },
        kRanges);
    for (std::size_t j = 0; j < rows_.size(); ++j) {
      for (const Shared& s : rows_[j]) {
        if (s.joint != j) continue;
        // The mean stiffness is computed about the middle of each joint's vertices: with the long
        // arms from a far pivot it would be too large.
        const Vec3 off = state.joints[j].place - state.joints[j].position;
        const double own = s.qp.trace() - 2.0 * off.dot(s.p) + off.squaredNorm() * s.mass;
        turn_ += 2.0 / 3.0 * own / std::max(1, n);
        shift_ += s.mass / std::max(1, n);
      }
    }
    solver_.compute(matrix([](std::size_t) { return Mat3(Mat3::Identity()); }));
  }

  int column(std::size_t joint) const { return column_[joint]; }
  int size() const { return size_; }
  double ridge(int row) const {
    const bool far = at_pivot_[static_cast<std::size_t>(row / 6)];
    if (row % 6 >= 3) return (far ? kShiftAtPivot : kShift) * shift_ + 1e-12;
    return (far ? kTurnAtPivot : kTurn) * turn_ + 1e-12;
  }
  const Factor& at_rest() const { return solver_; }

  /// The lower half of the stiffness matrix of chosen joints in their present rotations, as a dense
  /// matrix.
  /// In: at           [joints] a joint's index among the chosen joints, ascending; -1: not chosen
  ///     count        number of chosen joints
  ///     turn(joint)  the joint's rotation
  template <class Turn>
  Eigen::MatrixXd among(const std::vector<int>& at, int count, const Turn& turn) const {
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(6 * count, 6 * count);
    for (std::size_t j = 0; j < rows_.size(); ++j) {
      if (at[j] < 0) continue;
      for (const Shared& s : rows_[j]) {
        if (at[s.joint] < 0) continue;
        out.block<6, 6>(6 * at[s.joint], 6 * at[j]) = block(s, turn(j), turn(s.joint)).transpose();
      }
      for (int r = 0; r < 6; ++r) out(6 * at[j] + r, 6 * at[j] + r) += ridge(6 * column_[j] + r);
    }
    return out;
  }

  /// The lower half of the stiffness matrix of all joints that are not given, in their present
  /// rotations. In: turn(joint)  the joint's rotation
  template <class Turn>
  Sparse matrix(const Turn& turn) const {
    std::vector<Eigen::Triplet<double>> entries;
    for (std::size_t j = 0; j < rows_.size(); ++j) {
      for (const Shared& s : rows_[j]) {
        const Mat6 b = block(s, turn(j), turn(s.joint));
        const int row = 6 * column_[j], col = 6 * s.column;
        for (int x = 0; x < 6; ++x) {
          for (int y = row == col ? x : 0; y < 6; ++y)
            entries.emplace_back(col + y, row + x, b(x, y));
        }
      }
    }
    for (int r = 0; r < size_; ++r) entries.emplace_back(r, r, ridge(r));
    Sparse out(size_, size_);
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
  }

 private:
  std::vector<int> column_;
  std::vector<std::vector<Shared>> rows_;
  std::vector<bool> at_pivot_;  // by column
  int size_ = 0;
  double turn_ = 0.0, shift_ = 0.0;
  Factor solver_;
};

/// Computes the torque and the force of the residual on a joint in each expression.
/// Out: out  [E] torque, force
void gradient(const Problem& problem, const Joint& joint,
              const std::vector<ByJoint::Entry>& weights, const std::vector<float>& left,
              std::vector<Vec6>& out) {
  const std::size_t count = problem.expressions;
  // Sums of r and of (v - c) r^T over the joint's vertices v, with the residual r of the vertex and
  // the joint's position c. The torque follows from the second sum. For each axis of r there are
  // four rows of all expressions: r times each axis of v - c, then r alone.
  std::vector<float> sums(12 * count, 0.0f);
  for (const auto& entry : weights) {
    const double s = problem.importance[entry.vertex] * entry.weight;
    const Vec3 arm = s * (problem.positions[entry.vertex] - joint.position);
    const float* r = left.data() + std::size_t{entry.vertex} * count * 3;
    const auto x = static_cast<float>(arm[0]), y = static_cast<float>(arm[1]);
    const auto z = static_cast<float>(arm[2]), w = static_cast<float>(s);
    float* sum = sums.data();
    for (std::size_t k = 0; k < 3; ++k, r += count, sum += 4 * count) {
      for (std::size_t e = 0; e < count; ++e) {
        sum[e] += x * r[e];
        sum[count + e] += y * r[e];
        sum[2 * count + e] += z * r[e];
        sum[3 * count + e] += w * r[e];
      }
    }
  }
  for (std::size_t e = 0; e < count; ++e) {
    Mat3 arms;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      const float* sum = sums.data() + 4 * k * count + e;
      for (std::size_t x = 0; x < 3; ++x) {
        arms(static_cast<Eigen::Index>(x), at) = double{sum[x * count]};
      }
      out[e][3 + at] = double{sum[3 * count]};
    }
    const Mat3 m = joint.rotations[e] * arms;  // sum of (R arm) r^T
    out[e].head<3>() = Vec3(m(1, 2) - m(2, 1), m(2, 0) - m(0, 2), m(0, 1) - m(1, 0));
  }
}

Vec3 rotation_vector(const Mat3& rotation) {
  const Eigen::AngleAxisd turned(rotation);
  return turned.angle() * turned.axis();
}

}  // namespace

void rest(Joint& joint, std::size_t expressions) {
  joint.rotations.assign(expressions, Mat3::Identity());
  joint.translations.assign(expressions, Vec3::Zero());
  joint.motions.assign(expressions, Affine::Zero());
}

void update_motion(Joint& joint, std::size_t e) {
  Affine& m = joint.motions[e];
  m.leftCols<3>() = joint.rotations[e] - Mat3::Identity();
  m.col(3) = joint.translations[e] - m.leftCols<3>() * joint.position;
}

void find_residual(const Problem& problem, const State& state, std::vector<float>& left) {
  const std::size_t count = problem.expressions, joints = state.joints.size();
  // [J][12][E] the matrices of the joints' motions: for each of the 12 numbers of a matrix, a row
  // with the values in all expressions.
  std::vector<float> motions(joints * 12 * count);
  for (std::size_t j = 0; j < joints; ++j) {
    if (state.joints[j].rests) continue;
    for (std::size_t e = 0; e < count; ++e) {
      const double* m = state.joints[j].motions[e].data();
      float* out = motions.data() + 12 * j * count + e;
      for (std::size_t x = 0; x < 12; ++x) out[x * count] = static_cast<float>(m[x]);
    }
  }
  left = problem.displacements;
  core::parallel_for(problem.vertices, problem.threads, [&](std::size_t from, std::size_t to) {
    for (std::size_t v = from; v < to; ++v) {
      const Eigen::Vector3f p = problem.positions[v].cast<float>();
      for (const Influence& i : state.weights[v]) {
        if (state.joints[i.joint].rests) continue;
        const auto weight = static_cast<float>(i.weight);
        const float wx = weight * p.x(), wy = weight * p.y(), wz = weight * p.z();
        const float* m = motions.data() + 12 * i.joint * count;
        float* out = left.data() + v * 3 * count;
        for (std::size_t k = 0; k < 3; ++k, m += 4 * count, out += count) {
          for (std::size_t e = 0; e < count; ++e) {
            out[e] -=
                m[e] * wx + m[count + e] * wy + m[2 * count + e] * wz + m[3 * count + e] * weight;
          }
        }
      }
    }
  });
}

namespace {

/// [E] the sum of the squared residuals of each expression over all vertices, each times the
/// importance of its vertex.
std::vector<double> energies(const Problem& problem, const std::vector<float>& left) {
  const std::size_t count = problem.expressions;
  std::vector<double> out(count);
  core::parallel_for(count, problem.threads, [&](std::size_t from, std::size_t to) {
    for (std::size_t v = 0; v < problem.vertices; ++v) {
      const float *x = left.data() + v * count * 3, *y = x + count, *z = y + count;
      for (std::size_t e = from; e < to; ++e) {
        out[e] += problem.importance[v] * double{x[e] * x[e] + y[e] * y[e] + z[e] * z[e]};
      }
    }
  });
  return out;
}

/// Changes the joints' motions by the step in each expression. In an expression whose error would
/// grow, the step is shortened, at last to 0.
/// In:  step  [6 * columns, E] rotation vector and translation of each joint that is not given
/// In/out: left  the residual before and after the step
void take_step(const Problem& problem, State& state, const System& system,
               const Eigen::MatrixXd& step, std::vector<float>& left) {
  const std::size_t count = problem.expressions;
  const State before = state;
  const std::vector<double> energy = energies(problem, left);
  std::vector<double> share(count, 1.0);
  std::vector<bool> open(count, true);
  for (int trial = 0; trial < 4; ++trial) {
    core::parallel_for(state.joints.size(), problem.threads, [&](std::size_t from, std::size_t to) {
      for (std::size_t j = from; j < to; ++j) {
        if (system.column(j) < 0) continue;
        Joint& joint = state.joints[j];
        const Joint& old = before.joints[j];
        for (std::size_t e = 0; e < count; ++e) {
          if (!open[e]) continue;
          const Vec6 s =
              share[e] * step.block<6, 1>(6 * system.column(j), static_cast<Eigen::Index>(e));
          const double angle = s.head<3>().norm();
          joint.rotations[e] = old.rotations[e];
          if (angle > 0) {
            joint.rotations[e] =
                Eigen::AngleAxisd(angle, s.head<3>() / angle).toRotationMatrix() * old.rotations[e];
          }
          joint.translations[e] = old.translations[e] + s.tail<3>();
          update_motion(joint, e);
        }
      }
    });
    find_residual(problem, state, left);
    const std::vector<double> now = energies(problem, left);
    bool any = false;
    for (std::size_t e = 0; e < count; ++e) {
      open[e] = open[e] && now[e] > energy[e];
      if (open[e]) share[e] = trial < 2 ? share[e] / 3 : 0.0;
      any = any || open[e];
    }
    if (!any) return;
  }
}

/// The step of all joints in expression e, in which some joints take no part; the step of these
/// joints is 0.
/// In: right  [6 * columns] torque and force on each joint that is not given
Eigen::VectorXd solve_few(const State& state, const System& system, std::size_t e,
                          const Eigen::VectorXd& right) {
  std::vector<int> at(state.joints.size(), -1);
  int count = 0;
  for (std::size_t j = 0; j < at.size(); ++j) {
    if (system.column(j) >= 0 && !state.joints[j].is_idle(e)) at[j] = count++;
  }
  const Eigen::MatrixXd matrix =
      system.among(at, count, [&](std::size_t j) { return state.joints[j].rotations[e]; });
  Eigen::VectorXd part(6 * count), out = Eigen::VectorXd::Zero(right.size());
  for (std::size_t j = 0; j < at.size(); ++j) {
    if (at[j] >= 0) part.segment<6>(6 * at[j]) = right.segment<6>(6 * system.column(j));
  }
  part = matrix.llt().solve(part);
  for (std::size_t j = 0; j < at.size(); ++j) {
    if (at[j] >= 0) out.segment<6>(6 * system.column(j)) = part.segment<6>(6 * at[j]);
  }
  return out;
}

/// The step of all joints in expression e, which rotates joints far: conjugate gradients solve the
/// system with the stiffness in the present rotations. The preconditioner is the stiffness in the
/// neutral pose, applied in the joints' rotated axes: it is exact if joints that share vertices
/// have equal rotations.
Eigen::VectorXd solve_turned(const State& state, const System& system, std::size_t e,
                             const Eigen::VectorXd& right) {
  const Sparse matrix = system.matrix([&](std::size_t j) { return state.joints[j].rotations[e]; });
  const auto turn = [&](Eigen::VectorXd& all, bool back) {
    for (std::size_t j = 0; j < state.joints.size(); ++j) {
      if (system.column(j) < 0) continue;
      const Mat3& r = state.joints[j].rotations[e];
      for (int half = 0; half < 6; half += 3) {
        auto part = all.segment<3>(6 * system.column(j) + half);
        part = (back ? Mat3(r.transpose()) : r) * Vec3(part);
      }
    }
  };
  const auto near_inverse = [&](Eigen::VectorXd v) {
    turn(v, true);
    v = system.at_rest().solve(v);
    turn(v, false);
    return v;
  };
  Eigen::VectorXd x = Eigen::VectorXd::Zero(right.size()), left = right;
  Eigen::VectorXd z = near_inverse(left), direction = z;
  double energy = left.dot(z);
  const double enough = kEnough * energy;
  for (int step = 0; step < 40 && energy > enough; ++step) {
    const Eigen::VectorXd pushed = matrix.selfadjointView<Eigen::Lower>() * direction;
    const double length = energy / direction.dot(pushed);
    x += length * direction;
    left -= length * pushed;
    z = near_inverse(left);
    const double next = left.dot(z);
    direction = z + next / energy * direction;
    energy = next;
  }
  return x;
}

}  // namespace

void solve_motions(const Problem& problem, State& state, std::vector<float>& left) {
  const ByJoint weights = by_joint(state);
  const System system(problem, state, weights);
  const std::size_t count = problem.expressions;
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(system.size(), static_cast<Eigen::Index>(count));
  core::parallel_for(
      state.joints.size(), problem.threads,
      [&](std::size_t from, std::size_t to) {
        std::vector<Vec6> asked(count);
        for (std::size_t j = from; j < to; ++j) {
          if (system.column(j) < 0) continue;
          gradient(problem, state.joints[j], weights.of[j], left, asked);
          const int row = 6 * system.column(j);
          for (std::size_t e = 0; e < count; ++e) {
            const Joint& joint = state.joints[j];
            asked[e].head<3>() -= system.ridge(row) * rotation_vector(joint.rotations[e]);
            asked[e].tail<3>() -= system.ridge(row + 3) * joint.translations[e];
            right.block<6, 1>(row, static_cast<Eigen::Index>(e)) = asked[e];
          }
        }
      },
      kRanges);
  Eigen::MatrixXd step(right.rows(), right.cols());
  core::parallel_for(
      count, problem.threads,
      [&](std::size_t from, std::size_t to) {
        for (std::size_t e = from; e < to; ++e) {
          const auto column = static_cast<Eigen::Index>(e);
          if (std::any_of(state.joints.begin(), state.joints.end(),
                          [&](const Joint& j) { return j.is_idle(e); })) {
            step.col(column) = solve_few(state, system, e, right.col(column));
            continue;
          }
          const bool turned =
              std::any_of(state.joints.begin(), state.joints.end(), [&](const Joint& j) {
                return j.rotations[e].trace() < 3 - kFar * kFar;  // trace = 1 + 2 cos(angle)
              });
          if (!turned) {
            step.col(column) = system.at_rest().solve(right.col(column));
            continue;
          }
          step.col(column) = solve_turned(state, system, e, right.col(column));
        }
      },
      kRanges);
  take_step(problem, state, system, step, left);
}

}  // namespace risorius::author::detail
