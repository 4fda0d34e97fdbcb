#ifndef OPENMM_CYLINDERCHAINLINKFORCE_H_
#define OPENMM_CYLINDERCHAINLINKFORCE_H_

#include "couplings/LinkTable.h"
#include "mechanics/StretchingModels.h"
#include "openmm/Context.h"
#include "openmm/CylinderChainCoupling.h"
#include "openmm/Vec3.h"
#include <string>
#include <vector>

namespace OpenMM {

class CylinderChainLinkForceImpl;

/**
 * This class links filaments with each other, with other particles and with fixed points: springs between two places
 * that come and go while a simulation runs.
 *
 * A place is between two particles, such as the ends of a segment, at (1-f) x1+f x2 for a fraction f between 0 and 1;
 * or at a particle; or a point that does not move.  Where the two are neighbouring nodes of a chain of beam elements,
 * it is on the curve between them, at the parameter f.  A link has an energy of the distance d of its places.  Where
 * they coincide, the force of a link has no direction and is zero, even if its rest length is not.
 *
 * A particle that is a TwoParticleAverageSite whose weights are not negative and add up to 1 is replaced by the place
 * between its parents when a Context is created: forces act on them, as they would by OpenMM.  So is one that is a
 * LocalCoordinatesSite of the nodes and control points of a beam element with the weights of a place on its curve.
 *
 * This class holds the links that every new Context begins with.  After that, links belong to the Context: the methods
 * that take one change its links alone, at any time, and neither this object nor other Contexts.  Links are known by
 * their numbers.  No other link of a Context gets the number of one that is removed, unless setLinksInContext() gives
 * it one.
 *
 * A parameter of the Context holds a digest of its links, so that States and checkpoints say which belong to them.
 * Going back to one restores the links that the Context had then, up to 256 changes ago (fewer if they changed more
 * than 2^20 links together).  CylinderChainIntegrator writes links into its checkpoints, and into States that hold the
 * parameters of the Integrator: these restore them in any Context and any process.  With other Integrators, save what
 * getLinksInContext() returns beside the State, and give it to setLinksInContext().
 *
 * Instead of places, all links of an object may join the tangents of the curves of beam elements there, dr/ds, which
 * are nearly unit vectors, and points that stand for directions: see setJoinsTangents().
 *
 * Links do not make molecules: a barostat scales the centers of what they join separately.
 */
class CylinderChainLinkForce : public CylinderChainCoupling {
public:
    /**
     * The energy of a link whose places have the distance d, for the rest length d0 and the stiffness k:
     *
     * Harmonic: (k/2) (d-d0)^2.
     *
     * FENE: -(k/2) D^2 ln(1-((d-d0)/D)^2), so that the distance stays within d0-D and d0+D.
     */
    enum StretchingModel : int {CYLCHAIN_STRETCHING_MODELS(CYLCHAIN_ENUMERATOR)};
    /**
     * Get the names of all stretching models, in the order of StretchingModel.
     */
    static std::vector<std::string> getStretchingModelNames();
    /**
     * Create a CylinderChainLinkForce.
     */
    CylinderChainLinkForce();
    /**
     * Set whether links join tangents of beam elements in place of places, before a Context is created.  By default
     * they do not.  Each place must then be between two neighbouring nodes of a chain of beam elements, or at a virtual
     * site there, or a point, which is taken for a vector.  The tangent points from the first of two nodes that are
     * given to the second; that at a virtual site in the order of the chain's nodes.  d is the absolute value of the
     * difference of the two, which is never taken to its nearest image; lengths are numbers, and stiffnesses in kJ/mol.
     */
    void setJoinsTangents(bool tangents) {
        joinsTangents = tangents;
    }
    /**
     * Get whether links join tangents.
     */
    bool getJoinsTangents() const {
        return joinsTangents;
    }
    /**
     * Get the number of links.
     */
    int getNumLinks() const;
    /**
     * Get the numbers of all links, in ascending order.
     */
    std::vector<int> getLinkNumbers() const;
    /**
     * Get the number that the next link will have.
     */
    int getNextLinkNumber() const;
    /**
     * Add a link between two places.
     *
     * @param first1            the particle at fraction 0 of the first place
     * @param second1           the particle at fraction 1 of the first place, or -1 if the place is the first particle
     *                          itself
     * @param fraction1         where the first place is between them, from 0 to 1; without effect if second1 is -1
     * @param first2            the particle at fraction 0 of the second place
     * @param second2           the particle at fraction 1 of the second place, or -1
     * @param fraction2         where the second place is between them
     * @param stretchingModel   the energy of the link
     * @param restLength        the rest length d0, measured in nm; may be zero
     * @param stiffness         the stiffness k, measured in kJ/mol/nm^2; may be zero
     * @param maximumExtension  the maximum extension D, measured in nm; it has no effect unless the stretching model is
     *                          FENE
     * @return the number of the link that was added
     */
    int addLink(int first1, int second1, double fraction1, int first2, int second2, double fraction2,
            StretchingModel stretchingModel, double restLength, double stiffness, double maximumExtension);
    /**
     * Add a link between a place and a point that does not move.
     *
     * @param first             the particle at fraction 0 of the place
     * @param second            the particle at fraction 1 of the place, or -1 if the place is the first particle itself
     * @param fraction          where the place is between them, from 0 to 1; without effect if second is -1
     * @param point             the point, measured in nm
     * @param stretchingModel   the energy of the link
     * @param restLength        the rest length d0, measured in nm; may be zero
     * @param stiffness         the stiffness k, measured in kJ/mol/nm^2; may be zero
     * @param maximumExtension  the maximum extension D, measured in nm; it has no effect unless the stretching model is
     *                          FENE
     * @return the number of the link that was added
     */
    int addLinkToPoint(int first, int second, double fraction, const Vec3& point, StretchingModel stretchingModel,
            double restLength, double stiffness, double maximumExtension);
    /**
     * Remove a link.
     *
     * @param number  the number of the link
     */
    void removeLink(int number);
    /**
     * Get the places that a link joins.
     *
     * @param number          the number of the link
     * @param[out] first1     the particle at fraction 0 of the first place
     * @param[out] second1    the particle at fraction 1 of the first place, or -1
     * @param[out] fraction1  where the first place is between them
     * @param[out] first2     the particle at fraction 0 of the second place, or -1 if it is a point
     * @param[out] second2    the particle at fraction 1 of the second place, or -1
     * @param[out] fraction2  where the second place is between them
     * @param[out] point      the second place if it is a point, measured in nm
     */
    void getLinkPlaces(int number, int& first1, int& second1, double& fraction1, int& first2, int& second2,
            double& fraction2, Vec3& point) const;
    /**
     * Set the places that a link joins.
     *
     * @param number     the number of the link
     * @param first1     the particle at fraction 0 of the first place
     * @param second1    the particle at fraction 1 of the first place, or -1 if the place is the first particle itself
     * @param fraction1  where the first place is between them, from 0 to 1
     * @param first2     the particle at fraction 0 of the second place, or -1 if it is a point
     * @param second2    the particle at fraction 1 of the second place, or -1
     * @param fraction2  where the second place is between them
     * @param point      the second place if it is a point, measured in nm
     */
    void setLinkPlaces(int number, int first1, int second1, double fraction1, int first2, int second2,
            double fraction2, const Vec3& point = Vec3());
    /**
     * Get the parameters of a link.
     *
     * @param number                 the number of the link
     * @param[out] stretchingModel   the energy of the link, a StretchingModel
     * @param[out] restLength        the rest length d0, measured in nm
     * @param[out] stiffness         the stiffness k, measured in kJ/mol/nm^2
     * @param[out] maximumExtension  the maximum extension D, measured in nm
     */
    void getLinkParameters(int number, int& stretchingModel, double& restLength, double& stiffness,
            double& maximumExtension) const;
    /**
     * Set the parameters of a link.
     *
     * @param number            the number of the link
     * @param stretchingModel   the energy of the link
     * @param restLength        the rest length d0, measured in nm
     * @param stiffness         the stiffness k, measured in kJ/mol/nm^2
     * @param maximumExtension  the maximum extension D, measured in nm
     */
    void setLinkParameters(int number, StretchingModel stretchingModel, double restLength, double stiffness,
            double maximumExtension);
    /**
     * Get the parameters for links that are given none of their own by whoever adds them.
     *
     * @param[out] stretchingModel   the energy of a link, a StretchingModel
     * @param[out] restLength        the rest length d0, measured in nm
     * @param[out] stiffness         the stiffness k, measured in kJ/mol/nm^2
     * @param[out] maximumExtension  the maximum extension D, measured in nm
     */
    void getDefaultLinkParameters(int& stretchingModel, double& restLength, double& stiffness,
            double& maximumExtension) const;
    /**
     * Set the parameters for links that are given none of their own by whoever adds them.  This class does not use
     * them: it keeps them with the System.  All are zero unless this is called.
     *
     * @param stretchingModel   the energy of a link
     * @param restLength        the rest length d0, measured in nm
     * @param stiffness         the stiffness k, measured in kJ/mol/nm^2
     * @param maximumExtension  the maximum extension D, measured in nm
     */
    void setDefaultLinkParameters(StretchingModel stretchingModel, double restLength, double stiffness,
            double maximumExtension);
    /**
     * Get whether a link is switched on.
     *
     * @param number  the number of the link
     */
    bool isLinkActive(int number) const;
    /**
     * Switch a link on or off.  One that is off keeps its number, places and parameters.
     *
     * @param number  the number of the link
     * @param active  whether it is on
     */
    void setLinkActive(int number, bool active);
    /**
     * Get all links at once.
     *
     * @param[out] numbers     the numbers of the links, in ascending order
     * @param[out] ends        first1, second1, first2 and second2 of each
     * @param[out] fractions   fraction1 and fraction2 of each
     * @param[out] points      the three coordinates of the second place of each if it is a point, measured in nm
     * @param[out] models      the StretchingModel of each
     * @param[out] parameters  the rest length, stiffness and maximum extension of each
     * @param[out] active      1 for each link that is on, 0 for each that is off
     * @param[out] nextNumber  the number that the next link will have
     */
    void getLinks(std::vector<int>& numbers, std::vector<int>& ends, std::vector<double>& fractions,
            std::vector<double>& points, std::vector<int>& models, std::vector<double>& parameters,
            std::vector<int>& active, int& nextNumber) const;
    /**
     * Replace all links.
     *
     * @param numbers     the numbers of the links, in ascending order
     * @param ends        first1, second1, first2 and second2 of each, as for setLinkPlaces()
     * @param fractions   fraction1 and fraction2 of each
     * @param points      the three coordinates of the second place of each if it is a point, measured in nm
     * @param models      the StretchingModel of each
     * @param parameters  the rest length, stiffness and maximum extension of each
     * @param active      1 for each link that is on, 0 for each that is off
     * @param nextNumber  the number that the next link will have, above all others
     */
    void setLinks(const std::vector<int>& numbers, const std::vector<int>& ends,
            const std::vector<double>& fractions, const std::vector<double>& points, const std::vector<int>& models,
            const std::vector<double>& parameters, const std::vector<int>& active, int nextNumber);
    /**
     * Add a link between two places to a Context.  The parameters are those of addLink().
     *
     * @return the number of the link that was added
     */
    int addLinkInContext(Context& context, int first1, int second1, double fraction1, int first2, int second2,
            double fraction2, StretchingModel stretchingModel, double restLength, double stiffness,
            double maximumExtension) const;
    /**
     * Add a link between a place and a point to a Context.  The parameters are those of addLinkToPoint().
     *
     * @return the number of the link that was added
     */
    int addLinkToPointInContext(Context& context, int first, int second, double fraction, const Vec3& point,
            StretchingModel stretchingModel, double restLength, double stiffness, double maximumExtension) const;
    /**
     * Add several links to a Context.  They get numbers that follow each other.
     *
     * @param context     the Context
     * @param ends        first1, second1, first2 and second2 of each link, as for setLinkPlaces()
     * @param fractions   fraction1 and fraction2 of each
     * @param points      the three coordinates of the second place of each if it is a point, measured in nm; may be
     *                    empty if none is
     * @param models      the StretchingModel of each
     * @param parameters  the rest length, stiffness and maximum extension of each
     * @return the number of the first link that was added
     */
    int addLinksInContext(Context& context, const std::vector<int>& ends, const std::vector<double>& fractions,
            const std::vector<double>& points, const std::vector<int>& models,
            const std::vector<double>& parameters) const;
    /**
     * Remove links from a Context.
     *
     * @param context  the Context
     * @param numbers  the numbers of the links, each once
     */
    void removeLinksInContext(Context& context, const std::vector<int>& numbers) const;
    /**
     * Switch links of a Context on or off.
     *
     * @param context  the Context
     * @param numbers  the numbers of the links, each once
     * @param active   whether they are on
     */
    void setLinksActiveInContext(Context& context, const std::vector<int>& numbers, bool active) const;
    /**
     * Set the parameters of links of a Context.
     *
     * @param context     the Context
     * @param numbers     the numbers of the links, each once
     * @param models      the StretchingModel of each
     * @param parameters  the rest length, stiffness and maximum extension of each
     */
    void setLinkParametersInContext(Context& context, const std::vector<int>& numbers, const std::vector<int>& models,
            const std::vector<double>& parameters) const;
    /**
     * Get the number that the next link of a Context will have.
     */
    int getNextLinkNumberInContext(Context& context) const;
    /**
     * Get all links of a Context at once, like getLinks().
     */
    void getLinksInContext(Context& context, std::vector<int>& numbers, std::vector<int>& ends,
            std::vector<double>& fractions, std::vector<double>& points, std::vector<int>& models,
            std::vector<double>& parameters, std::vector<int>& active, int& nextNumber) const;
    /**
     * Replace all links of a Context, like setLinks().  This can be done when its links are not known, because it has
     * got a State or checkpoint of another Context.
     */
    void setLinksInContext(Context& context, const std::vector<int>& numbers, const std::vector<int>& ends,
            const std::vector<double>& fractions, const std::vector<double>& points, const std::vector<int>& models,
            const std::vector<double>& parameters, const std::vector<int>& active, int nextNumber) const;
    /**
     * Get the name of the parameter of a Context that holds the digest of its links.
     */
    std::string getDigestParameter(Context& context) const;
    /**
     * Set whether the distance of the places of a link should be that of their nearest periodic images.  By default it
     * is not.  The two particles of a place are taken as they are, unless the System has a CylinderChainForce that
     * takes the ends of segments as their nearest images.
     */
    void setUsesPeriodicBoundaryConditions(bool periodic);
    /**
     * Get whether this Force makes use of periodic boundary conditions.
     */
    bool usesPeriodicBoundaryConditions() const;
    /**
     * Get the links that new Contexts begin with.
     */
    const cylchain::LinkTable& getTable() const {
        return table;
    }
    /**
     * Set the links that new Contexts begin with.
     */
    void setTable(const cylchain::LinkTable& table) {
        this->table = table;
    }
    std::vector<cylchain::Place> findPlaces(const PlaceResolver& resolver) const;
protected:
    ForceImpl* createImpl() const;
private:
    CylinderChainLinkForceImpl& getImpl(Context& context) const;
    const cylchain::LinkEntry& getEntry(int number) const;
    void replaceEntry(const cylchain::LinkEntry& entry);
    cylchain::LinkTable table;
    cylchain::Link defaults;
    bool usePeriodic, joinsTangents;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINLINKFORCE_H_*/
