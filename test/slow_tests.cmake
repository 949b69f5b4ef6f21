# Tests that take more than 0.3 s on an idle core, by program, as GoogleTest's filters: the fast tier leaves them out.
# `./dev test fast` says how long it took; what makes it long belongs here.
set(OCTOSURF_SLOW_accuracy *)
set(OCTOSURF_SLOW_adapters InsertPointCloud.EqualsOctomapsForAllArguments
    InsertPointCloud.GoesOctomapsWayWhereItsStateIsOutOfReach InsertPointCloud.LetsTheTreeUpdateItsNodes
    InsertPointCloud.EqualsOctomapsFarFromTheOriginAndOnDerivedTrees)
set(OCTOSURF_SLOW_adapters_of_maps OctreeOfAMap.*)
set(OCTOSURF_SLOW_alignment AlignedMap.ASensorsTiltAndScaleAreFoundAndAreNoDrift AlignedMap.ASingleScanFarOffIsLeftOut
    AlignedMap.ASessionAmongPeopleIsMapped
    AlignedMap.DriftIsCorrectedToWhereThingsWereSeenFirst AlignedMap.ExactPosesGiveTheSameMapAsWithoutAlignment
    AlignedMap.LinesOfALaserAreNoJumps
    AlignedMap.PosesThatHaveJumpedForGoodAreFoundAgainWithTheSecondScan
    AlignedMap.WhatReadingsErrInCommonIsKnownWhetherOrNotPosesAreAligned Localizer.FindsScansFromGuessesFarOff
    NearSurfaces.PosesThatSlidDoNotMakeAPlaneUncertain PoseFit.ErrorsAreAsItsCovarianceSays
    Revisits.TellABendThatNoMotionExplains Revisits.TellHowFarThePoseIsOff)
set(OCTOSURF_SLOW_apps Diff.* EarlyEnd.ASignalLeavesNoLockNorPartOfAnyVerbThatWritesAMap EarlyEnd.SignalsSaveWhatIsMapped FailingRun.ACheckpointThatFailsIsToldOnceAndTheRunGoesOn
    FailingRun.AFullDiskNamesTheLastCheckpoint FailingRun.NoMemoryKeepsWhatWasMapped
    Killed.* MapRun.InRealTimeScansArriveAtTheirStamps
    MapRun.StoppingAndResumingGivesTheSameBytes Merge.* PlanVerb.*
    PoseCheck.PosesInAnotherFormAreToldAndTakenOnDemand Remap.*
    UpOption.GivenInEveryWay WrongUse.IsSaidInOneLineAndLeavesNothing)
set(OCTOSURF_SLOW_check *)
set(OCTOSURF_SLOW_contract Worlds/Contract.* MapperContract.ReportsItsTime)
set(OCTOSURF_SLOW_diagnosis Boundary.ALidarHasNoLimitOfACameras
    Boundary.AgreesWithWhatTheCamerasCouldSee Boundary.LabelsDependNeitherOnThreadsNorOnSaving
    Explain.EveryPendingPointOfARoomHasItsReason)
set(OCTOSURF_SLOW_evaluation PlanarRegion.AgreesWithBruteForceOnRandomPolygonsWithHolesAndIslands)
set(OCTOSURF_SLOW_example_contact_sequence *)
set(OCTOSURF_SLOW_footsteps Crawl.AQuadrupedClimbsAStairAndCrossesASmallGap
    Footsteps.AWallAcrossTheWayIsRefusedForItsClearance Footsteps.GoAroundWhatStandsInTheWayOrHangsOverIt)
set(OCTOSURF_SLOW_fuzz Corpus/EveryByte.*
    Fuzz.BagsOfManyTransformsAndScansTakeNoMoreMemoryThanOtherFiles
    Fuzz.LinesOfMillionsOfWordsTakeNoMoreMemoryThanOtherFiles)
set(OCTOSURF_SLOW_io DamagedMapFiles.*
    Removals.ComeBackWithWhoTookThemIn Removals.ManyComeBackInOrder ExportTest.FilesAreReadByPython
    MapFileTest.ALargeFloorWithoutNoiseComesBack MapFileTest.AMonthOfDaysIsSavedInPlace PictureTest.ATurnedMapWhoseUpIsGivenLooksTheSame
    PictureTest.IsoShowsFloorAndDefaultSize)
set(OCTOSURF_SLOW_detection Segment.ABoardOfThreeCentimetresPartsAWall LikelihoodDetector.*)
set(OCTOSURF_SLOW_mapper CoarserFaces.* Covariance.* Cylinders.ALaddersRungsAndRailsAreOneEach
    Cylinders.FlatThingsAreNone
    Cylinders.PillarsOfAHall Cylinders.PlanesAreTheSameWithAndWithout FinerFaces.* InsertAll.*
    Mapper.FloorWallAndBox
    Mapper.RingsThatAStandingLidarRepeatsMakeNoTiltedSurfaces Mapper.StripsOfATiltingLaserMakeSurfaces
    Mapper.SurfacesOfAnOctreeWithoutScans MergedMaps.* Readers.* UpOfAMap.ChangesNothingElse
    UpOfAMap.IsFoundHoweverItsFrameIsTurned Voxels/Faces.*)
set(OCTOSURF_SLOW_mapper_failures ChangesTogether.* FailedAllocations.*)
set(OCTOSURF_SLOW_occupancy AdoptOccupiedVoxels.PocketsUnderAFloorAreNotWhereItIsSeenFrom
    OccupancyDelta.FollowsTheOccupancyThreshold OccupancyDelta.IsTheDifferenceOfTheOccupiedVoxels
    OccupancyFiles.BtIsOctomapsOwn OccupancyFiles.NodesComeBackToTheBit
    OccupancyInsert.*
    ResampledOctree.KnowsWhatTheOtherKnowsAtItsCentres
    SharedView.TellsWhatHasChangedSinceAnyOther VoxelTree.TakesNoMoreHeapThanOctomapsTree)
set(OCTOSURF_SLOW_octomap Following.EqualsTheTreeMadeAnewAtEachScan*
    Following.ReadersInOtherThreadsSeeWholeTreesThatDoNotChange
    OctomapFilesTest.AnOtComesBackByOctomapsReaderAndByOurs)
set(OCTOSURF_SLOW_octomap_failures *)
set(OCTOSURF_SLOW_pcl NormalsAgainstPcl.* PaperDetector.IsThePapersAlgorithmWhereNothingIsTakenBack)
set(OCTOSURF_SLOW_planning Changes.LineageOverManyScansIsThatOverEachOfThem
    Changes.WhoFollowsThemHasWhatTheSnapshotHas ContactRegion.OfRandomPolygonsIsExact Inset.OfRandomPolygons OneAlign.* OneLaw.*)
set(OCTOSURF_SLOW_property *)
set(OCTOSURF_SLOW_simulation Cameras/DepthFolder.IsASevenScenesFolder*
    MeshFacesTest.HeapsOfBoxesAgreeWithThePointwiseTwin MeshRecording.AStairIsMappedStepByStep
    Meshes/TerrainData.*
    RealCameraTest.DepthsDeviateAsPublished
    RealCameraTest.OutlinesStrayByEightTenthsOfAPixelWithAFlyingPixelEach
    Recording.ChangeHappensMidway Recording.NoScanIsEmpty Recording.SameOptionsSameScansInAnyOrder
    Recording.TheRealCameraDropsOfWhatThePerfectOneSees VisibleCells.EachIsInSightOfSomeScan
    VisibleCells.LieInPolygonsInOrderAndSumUp)
set(OCTOSURF_SLOW_soak *)
set(OCTOSURF_SLOW_stairs Storeys.*)
set(OCTOSURF_SLOW_surfaces SurfaceModel.PolygonsAreTheAlphaShapeOfAllInliers
    SurfaceModel.PolygonsThatAreNotStaleAreRight)
