// Included into the namespace of an instruction set. It does not compile alone.

/**
 * For each segment, tell with its number how far a unit force along the segment, which pushes its ends apart, moves its
 * second end from its first. These are blocks of the inverse of the equations of TensionBand, from the last node to the
 * first; those of A with the tensions in it.
 *
 * That of rings is long: there should be one type of use for each number of lanes.
 *
 * @param compliances   of the tensions of all segments
 * @param use           use.takeResponse is called with the number of each segment and that vector; use.takeBlocks with
 *                      the number of each segment and three of the blocks: that of its first node, the one between its
 *                      nodes, and that of its second node
 */
template <int W, bool CLOSED, class Use> void findResponses(int n,
            const EliminatedPair<typename Lanes<W>::Type, CLOSED>* nodes,
            const typename Lanes<W>::Type* compliances, const Use& use) {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef Matrix<Real> Mat;
    typedef Symmetric<Real> Sym;
    // Of the next two nodes: their blocks of the inverse, and what a unit of compliance times start of the tension
    // behind the node moves them by, and changes that tension by.
    Sym same = {}, sameAfter = {};
    Mat other = {};
    Vec after = {}, afterNext = {};
    Real own = {};
    // In a ring, the same for the first two nodes: their own blocks, those of the next two nodes with them.
    Mat borders[2][2], next[2] = {}, second[2] = {};
    Vec ofBorder[2] = {};
    if constexpr (CLOSED) {
        const EliminatedPair<Real, CLOSED>& node = nodes[0];
        const Sym last = nodes[1].inverse;
        const Vec after1 = -nodes[1].give;
        const Vec here = node.pull*nodes[1].reciprocal-node.next*after1;
        use.takeResponse(0, (here-after1)*compliances[0]);
        borders[1][1] = Mat::of(last);
        borders[0][1] = -(node.next*borders[1][1]+Mat::outer(node.pull, after1));
        borders[1][0] = borders[0][1].transposed();
        Sym first = node.inverse;
        first.subtractProductTransposed(node.next, borders[0][1]);
        first.addOuter(-node.pull, here);
        borders[0][0] = Mat::of(first);
        const Real mutual = node.first.dot(after1)+node.share*nodes[1].reciprocal;
        ofBorder[1] = after1*node.share-last*node.first;
        ofBorder[0] = node.pull*mutual-node.give-node.next*ofBorder[1];
        own = node.reciprocal+node.first.dot(ofBorder[1])+node.share*mutual;
    }
    else {
        same = nodes[n-1].inverse;
        after = -nodes[n-1].give;
        own = nodes[n-1].reciprocal;
    }
    for (int s = CLOSED ? n-1 : n-2; s >= (CLOSED ? 2 : 0); s--) {
        const EliminatedPair<Real, CLOSED>& node = nodes[s];
        const Mat full = Mat::of(same), fullAfter = Mat::of(sameAfter);
        Vec here = node.pull*own-node.next*after-node.second*afterNext;
        if constexpr (CLOSED) {
            here = here-node.border[0]*ofBorder[0]-node.border[1]*ofBorder[1];
            use.takeResponse(s, (here-(s == n-1 ? ofBorder[0] : after))*compliances[s]);
        }
        else {
            use.takeResponse(s, (here-after)*compliances[s]);
            if (s == 0 && !Use::NEEDS_BLOCKS)
                return;
        }
        // The node's own block, and those with the next two.
        Mat newOther = node.next*full+node.second*other.transposed()+Mat::outer(node.pull, after);
        Mat newSecond = node.next*other+node.second*fullAfter+Mat::outer(node.pull, afterNext);
        Mat newBorder[2];
        if constexpr (CLOSED)
            for (int k = 0; k < 2; k++) {
                newOther = newOther+node.border[k]*next[k].transposed();
                newSecond = newSecond+node.border[k]*second[k].transposed();
                newBorder[k] = -(node.next*next[k]+node.second*second[k]+node.border[0]*borders[0][k]+
                        node.border[1]*borders[1][k]+Mat::outer(node.pull, ofBorder[k]));
            }
        newOther = -newOther;
        newSecond = -newSecond;
        Sym newSame = node.inverse;
        newSame.subtractProductTransposed(node.next, newOther);
        newSame.subtractProductTransposed(node.second, newSecond);
        newSame.addOuter(-node.pull, here);
        if constexpr (!CLOSED) {
            use.takeBlocks(s, newSame, newOther, same);
            if (s == 0)
                return;
        }

        // The same for the tension before the node.
        Real mutual = node.first.dot(after)+node.last.dot(afterNext)+node.share*own;
        Vec newAfterNext = after*node.share-same*node.first-other*node.last;
        Vec beyond = afterNext*node.share-other.transposedTimes(node.first)-sameAfter*node.last;
        if constexpr (CLOSED) {
            Vec newOfBorder[2];
            for (int k = 0; k < 2; k++) {
                newSame.subtractProductTransposed(node.border[k], newBorder[k]);
                mutual = mutual+node.tensionBorder[k].dot(ofBorder[k]);
                newAfterNext = newAfterNext-next[k]*node.tensionBorder[k];
                beyond = beyond-second[k]*node.tensionBorder[k];
                newOfBorder[k] = ofBorder[k]*node.share-next[k].transposedTimes(node.first)-
                        second[k].transposedTimes(node.last)-borders[k][0]*node.tensionBorder[0]-
                        borders[k][1]*node.tensionBorder[1];
            }
            if (s == n-1)
                use.takeBlocks(s, newSame, newBorder[0], borders[0][0].lower());
            else
                use.takeBlocks(s, newSame, newOther, same);
            after = node.pull*mutual-node.give-node.next*newAfterNext-node.second*beyond-node.border[0]*newOfBorder[0]-
                    node.border[1]*newOfBorder[1];
            own = node.reciprocal+node.first.dot(newAfterNext)+node.last.dot(beyond)+node.share*mutual+
                    node.tensionBorder[0].dot(newOfBorder[0])+node.tensionBorder[1].dot(newOfBorder[1]);
            for (int k = 0; k < 2; k++) {
                ofBorder[k] = newOfBorder[k];
                second[k] = next[k];
                next[k] = newBorder[k];
            }
        }
        else {
            after = node.pull*mutual-node.give-node.next*newAfterNext-node.second*beyond;
            own = node.reciprocal+node.first.dot(newAfterNext)+node.last.dot(beyond)+node.share*mutual;
        }
        afterNext = newAfterNext;
        sameAfter = same;
        same = newSame;
        other = newOther;
    }
    if constexpr (CLOSED) {
        use.takeResponse(1, (ofBorder[1]-after)*compliances[1]);
        use.takeBlocks(1, borders[1][1].lower(), next[1].transposed(), same);
        use.takeBlocks(0, borders[0][0].lower(), borders[0][1], borders[1][1].lower());
    }
}
