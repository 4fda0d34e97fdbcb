/**
 * The linear equations of a ring in the implicit scheme. All of its nodes are eliminated but the first two, its border, to
 * which all others are then coupled. ImplicitLoops.h includes this file.
 */

template <int W, bool CLOSED>
void ImplicitStep<W, CLOSED>::eliminateRing(const Vec* y) {
    ClosedRow rows[3];
    ClosedRow *before = rows, *here = rows+1, *after = rows+2;
    Border border = {};
    Geometry previous, current;
    std::size_t tether = 0;
    *here = ClosedRow {};
    here->right = loads[0];
    for (int s = 0; s < n-1; s++) {
        *after = ClosedRow {};
        describeNew(y, s, current);
        if (s < pack.segments)
            addSegment(y, s, current, *here, *after);
        else {
            here->lower = here->upper = Mat {};
            after->right = loads[s+1];
        }
        addTethers(y, s, tether, *here);
        if (s > 0) {
            addJoint(s, previous, current, *before, *here, *after);
            eliminateNodeOfRing(s-1, *before, *here, *after, border);
        }
        previous = current;
        ClosedRow* const free = before;
        before = here;
        here = after;
        after = free;
    }

    // What the rows of the nodes that come twice have gathered belongs to the first two.
    border.matrix[0][0] = border.matrix[0][0]+before->diagonal;
    border.matrix[0][1] = border.matrix[0][1]+before->upper;
    border.matrix[1][0] = border.matrix[1][0]+before->lower;
    border.matrix[1][1] = border.matrix[1][1]+here->diagonal;
    border.right[0] = border.right[0]+before->right;
    border.right[1] = border.right[1]+here->right;
    eliminateBorder(border);
}

template <int W, bool CLOSED>
void ImplicitStep<W, CLOSED>::eliminateNodeOfRing(int node, ClosedRow& row, ClosedRow& next, ClosedRow& second,
        Border& border) {
    if (node < 2) {
        border.matrix[node][node] = row.diagonal;
        border.right[node] = row.right;
        if (node == 0) {
            border.matrix[0][1] = row.upper;
            border.matrix[1][0] = row.lower;
        }
        else {
            next.toBorder[1] = row.lower;
            next.fromBorder[1] = row.upper;
        }
        second.toBorder[node] = row.second.transposed();
        second.fromBorder[node] = row.second;
        return;
    }
    if (node == pack.segments-2)
        coupleToBorder(row, 0, row.second.transposed(), row.second);
    if (node == pack.segments-1) {
        coupleToBorder(row, 0, row.lower, row.upper);
        coupleToBorder(row, 1, row.second.transposed(), row.second);
        row.lower = row.upper = Mat {};
    }
    if (node >= pack.segments-2)
        row.second = Mat {};
    eliminate<2>(node, row, next, second);
    const ImplicitNode<Real>& eliminated = nodes[node];
    const Mat secondT = row.second.transposed();
    for (int k = 0; k < 2; k++) {
        Mat& coupling = toBorder[node].node[k];
        coupling = eliminated.inverse*row.toBorder[k];
        next.toBorder[k] = next.toBorder[k]-row.lower*coupling;
        second.toBorder[k] = second.toBorder[k]-secondT*coupling;
        next.fromBorder[k] = next.fromBorder[k]-row.fromBorder[k]*eliminated.next;
        second.fromBorder[k] = second.fromBorder[k]-row.fromBorder[k]*eliminated.second;
        border.right[k] = border.right[k]-row.fromBorder[k]*eliminated.solution;
    }
    for (int k = 0; k < 2; k++)
        for (int l = 0; l < 2; l++)
            border.matrix[k][l] = border.matrix[k][l]-row.fromBorder[k]*toBorder[node].node[l];
}

template <int W, bool CLOSED>
void ImplicitStep<W, CLOSED>::coupleToBorder(ClosedRow& row, int k, const Mat& from, const Mat& to) {
    row.fromBorder[k] = row.fromBorder[k]+from;
    row.toBorder[k] = row.toBorder[k]+to;
}

template <int W, bool CLOSED>
void ImplicitStep<W, CLOSED>::eliminateBorder(const Border& border) {
    nodes[0].inverse = inverseOf(border.matrix[0][0], 0);
    nodes[0].solution = nodes[0].inverse*border.right[0];
    nodes[0].next = nodes[0].inverse*border.matrix[0][1];
    nodes[1].inverse = inverseOf(border.matrix[1][1]-border.matrix[1][0]*nodes[0].next, 1);
    nodes[1].solution = nodes[1].inverse*(border.right[1]-border.matrix[1][0]*nodes[0].solution);
}

template <int W, bool CLOSED>
void ImplicitStep<W, CLOSED>::substituteRing() {
    const int count = pack.segments;
    change[1] = nodes[1].solution;
    change[0] = nodes[0].solution-nodes[0].next*change[1];
    change[count] = change[0];
    change[count+1] = change[1];
    for (int node = count-1; node > 1; node--)
        change[node] = nodes[node].solution-nodes[node].next*change[node+1]-nodes[node].second*change[node+2]-
                toBorder[node].node[0]*change[0]-toBorder[node].node[1]*change[1];
}

template <int W, bool CLOSED>
void ImplicitStep<W, CLOSED>::addMetricForcesOfRing() {
    // Blocks of the inverse: those of the first two nodes, and of the next nodes (s+1) and (s+2) with them.
    Mat border[2][2];
    border[1][1] = nodes[1].inverse;
    border[0][1] = nodes[0].next*border[1][1]*(-1+Real{});
    border[1][0] = border[0][1].transposed();
    border[0][0] = nodes[0].inverse-nodes[0].next*border[1][0];
    Mat same = border[0][0], other = border[0][1], sameAfter = border[1][1];
    Mat next[2] = {border[0][0], border[0][1]}, second[2] = {border[1][0], border[1][1]};
    for (int s = pack.segments-1; s > 1; s--) {
        const ImplicitNode<Real>& node = nodes[s];
        const Mat* coupling = toBorder[s].node;
        Mat newOther = node.next*same+node.second*other.transposed();
        Mat newSecond = node.next*other+node.second*sameAfter;
        Mat newBorder[2];
        for (int k = 0; k < 2; k++) {
            newOther = newOther+coupling[k]*next[k].transposed();
            newSecond = newSecond+coupling[k]*second[k].transposed();
            newBorder[k] = (node.next*next[k]+node.second*second[k]+coupling[0]*border[0][k]+coupling[1]*border[1][k])*
                    (-1+Real{});
        }
        newOther = newOther*(-1+Real{});
        newSecond = newSecond*(-1+Real{});
        Mat newSame = node.inverse-node.next*newOther.transposed()-node.second*newSecond.transposed();
        for (int k = 0; k < 2; k++)
            newSame = newSame-coupling[k]*newBorder[k].transposed();
        newSame = (newSame+newSame.transposed())*(0.5+Real{});
        addMetricForce(s, newSame, newOther, same);
        sameAfter = same;
        same = newSame;
        other = newOther;
        for (int k = 0; k < 2; k++) {
            second[k] = next[k];
            next[k] = newBorder[k];
        }
    }
    addMetricForce(1, border[1][1], next[1].transposed(), same);
    addMetricForce(0, border[0][0], border[0][1], border[1][1]);
}
