%%%
  VERSION:1
  LANGUAGE:ENGLISH
%%%

MODULE Glue
  ! Glue bead on a door, fixture 2.  "tGun" measured with four points.
  TASK PERS tooldata tGun:=[TRUE,[[31.792,-12.5,229.639],[0.945518576,0,0.325568154,0]],[8.5,[12,0,110],[1,0,0,0],0,0.12,0.12]];
  TASK PERS wobjdata wDoor:=[FALSE,TRUE,"",[[1850,-250,720],[0.999048222,0,0,0.043619387]],[[0,0,12.5],[1,0,0,0]]];
  CONST jointtarget jHome:=[[0,10,-15,0,55,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pApproach:=[[120.25,40,150],[0.018504,-0.0097,0.99973,0.0073],[-1,0,1,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget p10:=[[120.25,40,0],[0.018504,-0.0097,0.99973,0.0073],[-1,0,1,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  PERS robtarget pBead{2}:=[[[220.5,180,0],[0,0,1,0],[-1,0,1,1],[9E9,9E9,9E9,9E9,9E9,9E9]],
                            [[320.5,180,0],[0,0,1,0],[-1,0,1,1],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  VAR robtarget pFound;
  VAR num nDoor:=3;

  PROC main()
    TPWrite "MoveL p10,v100,fine,tGun; is no move";
    MoveAbsJ jHome\NoEOffs,v1000,z50,tool0;
    MoveJ pApproach, v1000, z10, tGun\WObj:=wDoor;
    MoveL Offs(p10,0,0,25),v200,z1,tGun\WObj:=wDoor;
    MoveL p10,v100,fine,tGun\WObj:=wDoor; SetDO doGlue,1;
    MoveC pBead{1},pBead{2},v50,z1,tGun\WObj:=wDoor;
    ! MoveL p99,v50,z1,tGun\WObj:=wDoor;
    movel [[420.5,60,5],[0,0,1,0],[-1,0,1,1],[9E9,9E9,9E9,9E9,9E9,9E9]]\ID:=7,v50,fine,tGun\WObj:=wDoor;
    SetDO doGlue,0;
    pFound:=CRobT(\Tool:=tGun\WObj:=wDoor);
    MoveL RelTool(pFound,0,0,-100),v200,z10,tGun\WObj:=wDoor;
    MoveAbsJ [[5,0,-10,0,60,-90],[9E9,9E9,9E9,9E9,9E9,9E9]],v1000,fine,tool0;
  ENDPROC
ENDMODULE
