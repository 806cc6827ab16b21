"""What is seen in each figure, in words: for screen readers, and where no picture is shown."""

ALTERNATIVES = {
    "fig1": (
        "A capsule lies on hatched ground. In it a mass M_m is tied to the left wall by a spring "
        "k_1 above a damper c. Right of the mass, at a gap G, a plate stands before a spring k_2 "
        "on the right wall. Arrows: displacements X_m and X_c and the drive P_d cos Omega t to "
        "the right, friction F_r to the left."
    ),
    "fig2": (
        "Above, in perspective: the horizontal plane v_c = 0 cut by the upright plane x_r = "
        "delta, with six tinted surfaces S1 to S6 on the one and four, S7 to S10, on the other, "
        "the lines L1 to L8 between them and L9 upright. Below, the plane v_c = 0 from above for "
        "gaps less than, equal to and larger than the friction bound: two pairs of parallel "
        "oblique lines that meet the upright line in the points O1 and O2."
    ),
    "fig3": (
        "Three square sections with bundles of trajectories. On S1 those of F3 come from below "
        "and go on as F1; on S5 those of F4 and F6 come from both sides and go on along it as F5; "
        "across S7 those of F1 go on as F4. Arrows show both normals and the fields."
    ),
    "fig4": (
        "Left, the plane v_c = 0 with arrows of the stick fields along L1 to L4, black and grey "
        "for the two ends of the excitation. Right, six sections with bundles of trajectories "
        "across L1, two parts of L2, two parts of L3, and L4: beside each a stretch of stick "
        "begins or ends."
    ),
    "fig5": (
        "Left, the plane v_c = 0 with arrows across the upright line x_r = delta. Right, four "
        "sections with bundles of trajectories across L5 to L8: stick lies beside L6 and L7, none "
        "beside L5 and L8."
    ),
    "fig6": (
        "Closed orbits in the plane of relative displacement and velocity, one behind the other "
        "by excitation amplitude from 0 to 2: small ovals of stick that grow, and gain forward "
        "drift, then backward drift and a loop. The orbits at the exact bifurcation values are "
        "drawn wide."
    ),
    "fig7": (
        "Sixteen pairs of small diagrams, a to p, of growing amplitude. Left of each pair the "
        "displacements of mass and capsule over three periods: at rest on average at first, then "
        "in steps forward. Right the closed orbit with the switching lines, and its itinerary "
        "from F5 F2 to F4 F1 F3 F6."
    ),
    "fig8": (
        "Two rows: the orbits below, at and above a boundary-intersection crossing in the state "
        "space, whole on the left and magnified on the right, where the middle one passes through "
        "the line."
    ),
    "fig9": (
        "Four rows for adding-, crossing-, switching- and grazing-sliding: orbits below, at and "
        "above the value in the state space, whole on the left and magnified on the right, where "
        "the middle one touches or passes the line."
    ),
    "motion": (
        "Left, displacements of mass and capsule over three periods, the capsule in steps. Right, "
        "the closed orbit in the phase plane with the switching lines. Colours are those of the "
        "fields."
    ),
    "bifurcations": (
        "Three curves over the excitation amplitude from 0 to 2, all solid: stroboscopic relative "
        "displacement and velocity, which rise, and the average velocity, 0 up to 0.37 and then "
        "rising to 0.25. Eight circles mark the bifurcations, labelled above, with a "
        "key below."
    ),
    "itineraries": (
        "Coloured bands over the excitation amplitude, one for each field that acts, upwards by "
        "phase. Stick fills most below 0.37; forward drift with contact and then without it grows "
        "from there, backward drift begins as a tongue at 0.94, and stick ends beyond 1.6."
    ),
    "energies": (
        "Above, two stacked areas over the amplitude, the loss in the damper below that to "
        "friction, which together meet the line of the drive's work and reach 5. Below, "
        "friction's share: 0 up to 0.37, then rising to 0.78."
    ),
    "chart": (
        "A plane of amplitude and mass ratio, cut by eight curves into regions with an itinerary "
        "each. The first four curves are nearly upright; beyond an amplitude of 1.2 the curves "
        "bend and cross in circles."
    ),
    "margins": (
        "Four panels over one period: a bar of the itinerary, then gap, capsule velocity and "
        "force, each a curve in the colours of the fields that switches colour where it meets a "
        "dashed level."
    ),
    "work-precision": (
        "Error over time per period on logarithmic axes, a curve with markers for each tool and "
        "way to use it."
    ),
}
ALTERNATIVES["fig8-exact"] = ALTERNATIVES["fig8"]
ALTERNATIVES["fig9-exact"] = ALTERNATIVES["fig9"]
